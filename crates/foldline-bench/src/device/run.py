"""The kernel through CuPy, where there is no nvcc: compiles, times and compares as main.cu does, one variant."""

import sys

import cupy
import numpy as np

source = open("ensemble.cu").read()
module = cupy.RawModule(code=source, options=("--std=c++17",), backend="nvrtc")
kernel = module.get_function("fl_kernel")
sizes = {name: int(value) for _, name, value in (line.split() for line in source.splitlines() if line.startswith("#define FL_") and len(line.split()) == 3 and line.split()[2].isdigit())}
n, k = sizes["FL_N"], sizes["FL_SCALARS"]
reference = np.fromfile("reference.bin")
known = int(reference[0])
begin, end, tolerance = reference[1:4]
at = 7
parts = []
for size in (k, 2 * n, n * known, n * known, n * known, known):
    parts.append(reference[at : at + size])
    at += size
s, ranges, starts, own, exact, steps = parts
count = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
place = 0.5 + np.arange(1.0, count + 1) * np.sqrt(np.arange(n) + 2.0)[:, None]
low, high = ranges[::2, None], ranges[1::2, None]
every = low + (place - np.floor(place)) * (high - low)
every[:, :known] = starts.reshape(n, known)
members = [("count", "i8"), ("begin", "f8"), ("end", "f8"), ("sign", "f8"), ("longest", "f8"), ("limit", "f8"), ("size", "f8")]
members += [("relative", "f8"), ("absolute", "f8", n), ("s", "f8", k)]
members += [(name, "u8") for name in ("starts", "own", "states", "times", "outcomes", "steps", "rejected", "next")]
job = np.zeros(1, np.dtype(members, align=True))
arrays = dict(starts=cupy.asarray(every), states=cupy.empty((n, count)), times=cupy.empty(count), outcomes=cupy.empty(count, "i4"))
arrays |= dict(steps=cupy.empty(count, "u4"), rejected=cupy.empty(count, "u4"), next=cupy.zeros(1, "u8"))
for name, array in arrays.items():
    job[name] = array.data.ptr
for name, value in dict(count=count, begin=begin, end=end, sign=1, longest=1e100, limit=4e9, size=1, relative=tolerance, absolute=tolerance).items():
    job[name] = value
job["s"] = s
module.get_global("fl_the_job").copy_from_host(job.ctypes.data, job.nbytes)
blocks = cupy.cuda.Device().attributes["MultiProcessorCount"] * 4
for _ in range(3):
    arrays["next"].fill(0)
    start, stop = cupy.cuda.Event(), cupy.cuda.Event()
    start.record()
    kernel((blocks,), (128,), ())
    stop.record()
    stop.synchronize()
    time = 1e-3 * cupy.cuda.get_elapsed_time(start, stop)
total = int(arrays["steps"].sum(dtype="u8") + arrays["rejected"].sum(dtype="u8"))
apart = np.abs(arrays["states"].get()[:, :known] - own.reshape(n, known)).max(axis=0)
print(f"CuPy: {time:.4f} s, {total:.3e} steps, {total / time:.3e} steps/s; difference {np.median(apart):.1e}, largest {apart.max():.1e}")
