//! Meshes and specimens, their files, and directories of runs.

mod ensemble;
mod gmsh;
mod mesh;
mod meshing;
mod scanner;
mod specimen;
mod vtu;
