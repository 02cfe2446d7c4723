// An eighth of a sphere of radius 1: a wedge of 45 degrees between two planes of symmetry, z upwards. Fine where it touches the ground.
// gmsh -3 -format msh41 -setnumber fine 0.028 sphere-eighth.geo
SetFactory("OpenCASCADE");
DefineConstant[ fine = 0.028 ];
latitude = Asin(0.85);
Sphere(1) = {0, 0, 0, 1, -Pi/2, -latitude, Pi/4};
Sphere(2) = {0, 0, 0, 1, -latitude, Pi/2, Pi/4};
BooleanFragments{ Volume{1}; Delete; }{ Volume{2}; Delete; }
eps = 1e-4;
// sides by where they lie
sole() = {}; first() = {}; second() = {};
all() = Boundary{ Volume{:}; };
For k In {0 : #all() - 1}
  s = Abs(all(k));
  c() = CenterOfMass Surface{s};
  If (Fabs(c(1)) < eps)
    first() += s;
  ElseIf (Fabs(c(0) - c(1)) < eps)
    second() += s;
  ElseIf (c(2) < -0.85 - eps)
    sole() += s;
  EndIf
EndFor
Physical Surface("first") = {first()};
Physical Surface("second") = {second()};
Physical Surface("sole") = {sole()};
Physical Volume("sphere") = {1, 2};
Field[1] = Ball;
Field[1].ZCenter = -1;
Field[1].Radius = 0.2;
Field[1].Thickness = 0.8;
Field[1].VIn = fine;
Field[1].VOut = 4 * fine + 0.03;
Background Field = 1;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;
