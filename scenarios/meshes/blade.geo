// A twisted blade: root at z = 0, tip at z = 1. Its section is a curved strip of chord 0.4.
// gmsh -3 -order 2 -format msh41 blade.geo
SetFactory("Built-in");
chord = 0.4; camber = 0.05; thick = 0.045;
Point(1) = {-chord / 2, 0, 0};
Point(2) = {chord / 2, 0, 0};
Point(3) = {chord / 2, 0.5 * thick, 0};
Point(4) = {-chord / 2, 0.5 * thick, 0};
Point(5) = {0, camber, 0};
Point(6) = {0, camber + thick, 0};
Spline(1) = {1, 5, 2};
Line(2) = {2, 3};
Spline(3) = {3, 6, 4};
Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
Transfinite Curve{1, 3} = 5;
Transfinite Curve{2, 4} = 2;
Transfinite Surface{1};
Recombine Surface{1};
all() = Extrude { {0, 0, 1}, {0, 0, 1}, {0, 0, 0}, Pi / 5 } { Surface{1}; Layers{8}; Recombine; };
Physical Surface("root") = {1};
Physical Surface("tip") = {all(0)};
Physical Volume("blade") = {all(1)};
