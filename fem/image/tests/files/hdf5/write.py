"""Writes the HDF5 files that `hdf5.rs` reads: `python3 write.py`, with h5py 3.

The voxel at x, y, z has the value x + 10 y + 100 z; the volumes have 5 × 3 × 4 voxels.
"""

from pathlib import Path

import h5py
import numpy as np

FOLDER = Path(__file__).parent
z, y, x = np.meshgrid(np.arange(4), np.arange(3), np.arange(5), indexing="ij")
VALUES = x + 10 * y + 100 * z


def write(name, libver, fill):
    with h5py.File(FOLDER / name, "w", libver=libver) as file:
        fill(file)


def contiguous(file):
    data = file.create_dataset("exchange/data", data=VALUES.astype("<u2"))
    data.attrs["element_size_um"] = [20.0, 20.0, 20.0]
    file["exchange/theta"] = np.linspace(0.0, 180.0, 4)
    file["exchange/title"] = "contiguous"


def integers(file):
    for name, size in (("long", [20, 20, 20]), ("short", np.full(3, 20, "<u2"))):
        file.create_dataset(name, data=VALUES.astype("<u2")).attrs["element_size_um"] = size


def chunked(file):
    values = (VALUES - 200).astype("<i2")
    data = file.create_dataset(
        "data", data=values, chunks=(2, 2, 3), compression="gzip", shuffle=True, fletcher32=True
    )
    data.attrs["element_size_um"] = np.array([30.0, 20.0, 20.0], "<f4")


def ilastik(file):
    values = (VALUES // 2).astype("u1").reshape(1, 4, 3, 5, 1)
    file.create_dataset("exported_data", data=values, chunks=(1, 3, 2, 5, 1), compression="gzip")


def several(file):
    entry = file.create_group("entry/deep")
    file.create_dataset("entry/deep/raw", data=VALUES.astype(">f4"))
    file["entry/image"] = file["entry/deep/raw"]  # a second path of the same dataset
    entry["up"] = h5py.SoftLink("/entry")  # a loop
    entry["lost"] = h5py.SoftLink("/nothing")
    growing = dict(chunks=(1, 3, 5), maxshape=(None, 3, 5))
    file.create_dataset("entry/labels", data=VALUES.astype(">u4"), **growing)
    file.create_dataset("entry/exact", data=VALUES / 8, chunks=(4, 3, 5), compression="gzip")
    file.create_dataset("entry/wide", data=VALUES.astype("<i8") - 2**40)
    file.create_dataset("entry/lzf", data=np.full((4, 3, 5), 7, "<u2"), compression="lzf")
    file.create_dataset("entry/offset", data=VALUES.astype("<u2"), chunks=(2, 3, 5), scaleoffset=0)
    file.create_dataset("entry/szip", data=VALUES.astype("<u2"), chunks=(2, 3, 5), compression="szip")
    file.create_dataset("entry/half", data=VALUES.astype("<f2"))


def none(file):
    file["slice"] = VALUES[0].astype("<u2")
    file["movie"] = np.zeros((2, 4, 3, 5), "u1")


write("contiguous.h5", "earliest", contiguous)
write("integers.h5", "earliest", integers)
write("chunked.h5", "latest", chunked)
write("ilastik.h5", "earliest", ilastik)
write("several.h5", "latest", several)
write("none.h5", "earliest", none)
