// A slender beam, clamped at its root; the last tenth of its length moves between two stops.
// gmsh -2 -order 2 -format msh41 beam.geo
length = 1.0;
height = 0.05;
stop = 0.1; // length of the faces that meet the stops
Mesh.SecondOrderIncomplete = 0; // nine nodes

Point(1) = {0, 0, 0};
Point(2) = {length - stop, 0, 0};
Point(3) = {length, 0, 0};
Point(4) = {length, height, 0};
Point(5) = {length - stop, height, 0};
Point(6) = {0, height, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 6};
Line(6) = {6, 1};
Line(7) = {2, 5};
Curve Loop(1) = {1, 7, 5, 6};
Curve Loop(2) = {2, 3, 4, -7};
Plane Surface(1) = {1};
Plane Surface(2) = {2};
Transfinite Curve {1, 5} = 19;
Transfinite Curve {2, 4} = 3;
Transfinite Curve {3, 6, 7} = 2;
Transfinite Surface {1, 2};
Recombine Surface {1, 2};

Physical Curve("root") = {6};
Physical Curve("lower") = {2};
Physical Curve("upper") = {4};
Physical Surface("beam") = {1, 2};
