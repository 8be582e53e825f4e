// Annular footing with an eccentric hole: outer circle of radius 1 centred
// at the origin, circular hole of radius 0.3 centred at (0.3, 0).
// 115 equal edges on the outer circle and 34 on the hole; 929 triangles, 539 nodes.
SetFactory("OpenCASCADE");
no = 115;             // edges on the outer circle
ni = 34;              // edges on the hole
h = 0.0979;          // size inside

Circle(1) = {0, 0, 0, 1};
Circle(2) = {0.3, 0, 0, 0.3};
Curve Loop(1) = {1};
Curve Loop(2) = {2};
Plane Surface(1) = {1, 2};
Transfinite Curve {1} = no + 1;
Transfinite Curve {2} = ni + 1;

Physical Curve("edge", 1) = {1};
Physical Surface("footing", 2) = {1};
Physical Curve("hole", 3) = {2};

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
