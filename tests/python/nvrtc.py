"""Compiles kernels for a card with NVRTC (PyPI: nvidia-cuda-nvrtc-cu12), without a card.

Usage: nvrtc.py KERNELS.cu [ARCHITECTURE]
Exit code: 0 if the kernels compile, 1 if not (errors of the compiler on stderr), 77 if NVRTC is not installed.
"""

import ctypes
import glob
import sys
import sysconfig


def library():
    folder = sysconfig.get_paths()["purelib"]
    found = glob.glob(f"{folder}/nvidia/**/libnvrtc.so.1[0-9]", recursive=True)
    for path in found:
        return ctypes.CDLL(path)
    print("NVRTC is not installed", file=sys.stderr)
    sys.exit(77)


def main():
    nvrtc = library()
    with open(sys.argv[1], "rb") as file:
        source = file.read()
    architecture = sys.argv[2] if len(sys.argv) > 2 else "sm_90"
    program = ctypes.c_void_p()
    if nvrtc.nvrtcCreateProgram(ctypes.byref(program), source, b"kernels.cu", 0, None, None):
        sys.exit("no program")
    options = [b"--fmad=false", f"--gpu-architecture={architecture}".encode()]
    failed = nvrtc.nvrtcCompileProgram(
        program, len(options), (ctypes.c_char_p * len(options))(*options)
    )
    size = ctypes.c_size_t()
    nvrtc.nvrtcGetProgramLogSize(program, ctypes.byref(size))
    log = ctypes.create_string_buffer(size.value)
    nvrtc.nvrtcGetProgramLog(program, log)
    if failed:
        sys.exit(log.value.decode())
    nvrtc.nvrtcGetCUBINSize(program, ctypes.byref(size))
    print(f"{size.value} bytes for {architecture}")


if __name__ == "__main__":
    main()
