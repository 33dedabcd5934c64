//! Meshes and specimens, their files, and directories of runs.

mod curve;
mod ensemble;
mod fuzz;
mod gmsh;
mod mesh;
mod meshing;
mod scanner;
mod specimen;
mod stl;
mod voxel_grains;
mod vtu;
