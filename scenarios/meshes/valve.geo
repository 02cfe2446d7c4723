// A poppet valve, by its section: x is the radius, y the axis. The cone below its head meets the seat at 45 degrees.
// gmsh -2 -format msh41 valve.geo
stem = 0.15;
head = 0.5;
Point(1) = {0, -0.1, 0};
Point(2) = {0.3, -0.1, 0};
Point(3) = {head, 0.1, 0};
Point(4) = {head, 0.2, 0};
Point(5) = {stem, 0.3, 0};
Point(6) = {stem, 1.5, 0};
Point(7) = {0, 1.5, 0};
Point(8) = {0, 0.3, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 6};
Line(6) = {6, 7};
Line(7) = {7, 8};
Line(8) = {8, 1};
Line(9) = {8, 5};
Curve Loop(1) = {1, 2, 3, 4, -9, 8};
Curve Loop(2) = {9, 5, 6, 7};
Plane Surface(1) = {1};
Plane Surface(2) = {2};
Transfinite Curve {2} = 5;
Transfinite Curve {6, 9} = 3;
Transfinite Curve {5, 7} = 9;
Transfinite Surface {2};
Mesh.MeshSizeMax = 0.09;
Mesh.Algorithm = 8;
Mesh.RecombineAll = 1;

Physical Curve("axis") = {7, 8};
Physical Curve("seat") = {2};
Physical Curve("top") = {6};
Physical Curve("face") = {1};
Physical Surface("valve") = {1, 2};
