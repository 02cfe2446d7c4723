// Half a disc; the other half is its mirror image. Its lower quarter may touch the ground.
// gmsh -2 -format msh41 half-disc.geo
radius = 1.0;
Point(1) = {0, 0, 0, 0.25};
Point(2) = {0, -radius, 0, 0.1};
Point(3) = {radius * Sin(Pi / 4), -radius * Cos(Pi / 4), 0, 0.2};
Point(4) = {radius, 0, 0, 0.25};
Point(5) = {0, radius, 0, 0.25};
Circle(1) = {2, 1, 3};
Circle(2) = {3, 1, 4};
Circle(3) = {4, 1, 5};
Line(4) = {5, 1};
Line(5) = {1, 2};
Curve Loop(1) = {1, 2, 3, 4, 5};
Plane Surface(1) = {1};

Physical Curve("sole") = {1};
Physical Curve("symmetry") = {4, 5};
Physical Surface("disc") = {1};
