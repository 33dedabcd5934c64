//! Meshes and specimens, their files, and directories of runs.

mod curve;
mod ensemble;
mod gmsh;
mod mesh;
mod specimen;
mod vtu;
