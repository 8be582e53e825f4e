// Square footing [-1,1]^2 with its four corners excised by squares of
// side 0.5 (a plus-shaped plan, area 3, perimeter 8).
// 96 equal boundary edges of length 1/12; 1118 triangles, 608 nodes.
SetFactory("Built-in");
e = 0.5;              // side of the excised squares
n = 6;                // edges per length e
h = 0.08004;          // size inside
c = 1 - e;

Point(1) = {-c, -1, 0};
Point(2) = { c, -1, 0};
Point(3) = { c, -c, 0};
Point(4) = { 1, -c, 0};
Point(5) = { 1,  c, 0};
Point(6) = { c,  c, 0};
Point(7) = { c,  1, 0};
Point(8) = {-c,  1, 0};
Point(9) = {-c,  c, 0};
Point(10) = {-1,  c, 0};
Point(11) = {-1, -c, 0};
Point(12) = {-c, -c, 0};
For i In {1:11}
  Line(i) = {i, i + 1};
EndFor
Line(12) = {12, 1};
Curve Loop(1) = {1:12};
Plane Surface(1) = {1};
Transfinite Curve {1, 4, 7, 10} = 2*n + 1;                 // length 1
Transfinite Curve {2, 3, 5, 6, 8, 9, 11, 12} = n + 1;      // length 0.5

Physical Curve("edge", 1) = {1:12};
Physical Surface("footing", 2) = {1};

// One size h inside; the boundary is divided as set above.
Mesh.MeshSizeMin = h;
Mesh.MeshSizeMax = h;
Mesh.MeshSizeFromPoints = 0;
Mesh.MeshSizeFromCurvature = 0;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.Algorithm = 6; // Frontal-Delaunay
Mesh.RecombineAll = 0;
Mesh.ElementOrder = 1;
Mesh.Smoothing = 5;
Mesh.SaveAll = 0;
Mesh.Binary = 0;
Mesh.MshFileVersion = 4.1;
