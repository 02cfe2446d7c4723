// A frame on two feet: what stands on the ground by its weight.
// gmsh -2 -order 2 -format msh41 feet.geo
h = 0.1;
Point(1) = {0, 0, 0, h};
Point(2) = {0.25, 0, 0, h};
Point(3) = {0.25, 0.2, 0, h};
Point(4) = {0.75, 0.2, 0, h};
Point(5) = {0.75, 0, 0, h};
Point(6) = {1, 0, 0, h};
Point(7) = {1, 0.4, 0, h};
Point(8) = {0, 0.4, 0, h};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 6};
Line(6) = {6, 7};
Line(7) = {7, 8};
Line(8) = {8, 1};
Curve Loop(1) = {1, 2, 3, 4, 5, 6, 7, 8};
Plane Surface(1) = {1};

Physical Curve("feet") = {1, 5};
Physical Curve("top") = {7};
Physical Surface("frame") = {1};
