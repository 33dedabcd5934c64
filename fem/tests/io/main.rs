//! Meshes and specimens, their files, and directories of runs.

mod curve;
mod ensemble;
mod fuzz;
mod gmsh;
mod mesh;
mod meshing;
mod scanner;
mod shared_ensemble;
mod specimen;
mod stl;
mod voxel_grains;
mod vtu;
