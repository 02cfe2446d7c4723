// Half a section of a sphere of radius 1: x is the radius, y the axis. Fine where it touches the ground.
// gmsh -2 -order 2 -format msh41 -setnumber fine 0.02 sphere-ring.geo
DefineConstant[ fine = 0.02 ];
Point(1) = {0, 0, 0, 0.25};
Point(2) = {0, -1, 0, fine};
Point(3) = {Sin(0.3), -Cos(0.3), 0, fine};
Point(4) = {Sin(0.7), -Cos(0.7), 0, 0.12};
Point(5) = {1, 0, 0, 0.25};
Point(6) = {0, 1, 0, 0.25};
Circle(1) = {2, 1, 3};
Circle(2) = {3, 1, 4};
Circle(3) = {4, 1, 5};
Circle(4) = {5, 1, 6};
Line(5) = {6, 1};
Line(6) = {1, 2};
Curve Loop(1) = {1, 2, 3, 4, 5, 6};
Plane Surface(1) = {1};
Physical Curve("sole") = {1, 2};
Physical Curve("axis") = {5, 6};
Physical Surface("sphere") = {1};
