"""Segments the volumes of `cargo run --release -p fem-mesh --example segmentation FOLDER` with scikit-image. Prints the
scores and processor seconds of scikit-image and of that command.

    python3 segmentation.py FOLDER [VOLUME ...]

Needs numpy, scipy, scikit-image and tifffile. Two recipes are used. Both have a median filter of 3³ voxels and a watershed on the
Euclidean distance; the seeds are h-maxima of 0.5 voxel after a Gaussian filter of 1 voxel. The recipe `multi-otsu` uses the
upper threshold of multi-Otsu with three classes. The recipe `inside` uses Otsu's threshold of two classes inside the specimen.
For volumes of 256³ voxels, the paper's rule for seeds is also used, `spacing`: peaks at least 4 voxels apart, of distances in
whole voxels. Beam hardening is not corrected. The specimen is the largest component above the lower threshold of multi-Otsu,
with holes filled slice by slice. If grains are dark, `multi-otsu` uses the middle class and `inside` the lower class; if air is
then the brightest, the image is inverted first.

The rows are listed in docs/explanation/volumes.md. Volumes are in voxels; "ours" is Breccia with the rule `auto` or with the same seeds.
"""
import csv
import resource
import sys
import time
from pathlib import Path

import numpy as np
import scipy.ndimage as ndi
from skimage.feature import peak_local_max
from skimage.filters import threshold_multiotsu, threshold_otsu
from skimage.morphology import h_maxima
from skimage.segmentation import watershed
from tifffile import imread

LEAST = 30  # voxels


def specimen_of(smooth, void):
    parts, count = ndi.label(smooth >= void)
    if count == 0:
        return np.zeros(smooth.shape, bool)
    largest = np.argmax(np.bincount(parts.ravel())[1:]) + 1
    return np.stack([ndi.binary_fill_holes(part) for part in parts == largest])


def seeds_of(distance, rule):
    if rule != "spacing":
        smooth = ndi.gaussian_filter(distance, 1.0)
        return smooth, ndi.label(h_maxima(smooth, 0.5), np.ones((3, 3, 3)))[0]
    whole = np.floor(distance)
    peaks = peak_local_max(whole, min_distance=4, labels=(distance > 0).astype(int))
    seeds = np.zeros(distance.shape, int)
    seeds[tuple(peaks.T)] = np.arange(1, len(peaks) + 1)
    return whole, seeds


def segment(image, rule, contrast):
    """Returns the labels, and the voxels of the specimen."""
    is_dark = contrast == "dark"
    if is_dark and np.median(image[:, :8, :8]) > np.median(image):
        image, is_dark = image.max() - image, False
    # for integers scikit-image uses one bin per value instead of `nbins`, which takes minutes
    smooth = ndi.median_filter(image.astype(np.float32), 3)
    void, level = threshold_multiotsu(smooth, 3, nbins=1024)
    inside = specimen_of(smooth, void)
    if rule == "inside":
        # without the rim, whose grey values are between air and matrix
        core = ndi.binary_erosion(inside, iterations=2)
        level = threshold_otsu(smooth[core], nbins=1024)
        grain = inside & (smooth >= void) & (smooth < level) if is_dark else inside & (smooth >= level)
    else:
        grain = inside & (smooth >= void) & (smooth < level) if is_dark else smooth >= level
    distance = ndi.distance_transform_edt(grain).astype(np.float32)
    height, seeds = seeds_of(distance, rule)
    labels = watershed(-height, seeds, mask=grain)
    sizes = np.bincount(labels.ravel())
    kept = sizes >= LEAST
    kept[0] = False
    numbers = np.cumsum(kept) * kept
    return numbers[labels], inside.sum()


def score(truth, found):
    pairs, counts = np.unique(
        truth.astype(np.int64) << 32 | found.astype(np.int64), return_counts=True
    )
    a, b = pairs >> 32, pairs & 0xFFFFFFFF
    size_a, size_b = np.bincount(a, counts), np.bincount(b, counts)
    both = (a > 0) & (b > 0)
    iou = counts[both] / (size_a[a[both]] + size_b[b[both]] - counts[both])
    matched = iou > 0.5
    grains = (np.count_nonzero(size_a[1:]), np.count_nonzero(size_b[1:]))
    quality = iou[matched].sum() / (sum(grains) / 2)
    dice = 2 * counts[both].sum() / (size_a[1:].sum() + size_b[1:].sum())
    right = counts[both][matched].sum() / size_a[1:].sum()
    return {
        "grains": grains[1],
        "matched": matched.sum(),
        "pq": quality,
        "dice": dice,
        "right": right,
    }


def d50(sizes):
    sizes = np.sort(sizes)
    middle = np.searchsorted(np.cumsum(sizes), sizes.sum() / 2)
    return (6 * sizes[middle] / np.pi) ** (1 / 3)


def run(folder, name, rule, contrast):
    image, truth = imread(folder / f"{name}.tif"), imread(folder / f"{name}-truth.tif")
    start = time.process_time()
    labels, specimen = segment(image, rule, contrast)
    seconds = time.process_time() - start
    sizes = np.bincount(labels.ravel())[1:]
    found = score(truth, labels)
    found["seconds"] = seconds
    found["fraction"] = sizes.sum() / max(specimen, 1)
    found["median"] = np.median(sizes) if len(sizes) else np.nan
    found["d50"] = d50(sizes) if len(sizes) else np.nan
    return found


def error(value, truth):
    return f"{100 * (float(value) / float(truth) - 1):+.1f} %"


def volume_row(folder, name, rule, ours):
    found = run(folder, name, rule, ours["contrast"])
    print(
        f"| {name} | {rule} | {found['grains']} ({ours['true_grains']}) | {found['matched']}"
        f" | {found['pq']:.3f} ({float(ours['pq']):.3f}) | {found['dice']:.3f} ({float(ours['dice']):.3f})"
        f" | {100 * found['right']:.1f} % ({100 * float(ours['right']):.1f} %)"
        f" | {error(found['d50'], ours['true_d50'])} ({error(ours['d50'], ours['true_d50'])})"
        f" | {found['seconds']:.0f} ({float(ours['processor_seconds']):.0f}) |",
        flush=True,
    )


def specimen_row(folder, name, ours):
    """Returns one row for Breccia (`auto`) and both recipes: PQ, errors of the fraction and of the median volume."""
    row = f"| {name} | {ours['true_grains']} | {float(ours['true_fraction']):.4f}"
    recipes = {rule: run(folder, name, rule, ours["contrast"]) for rule in ("multi-otsu", "inside")}
    for key in ("pq", "fraction", "median"):
        for found in (ours, recipes["multi-otsu"], recipes["inside"]):
            value = found[key]
            row += f" | {float(value):.3f}" if key == "pq" else f" | {error(value, ours['true_' + key])}"
    print(row + " |", flush=True)


def main():
    folder, names = Path(sys.argv[1]), sys.argv[2:]
    with open(folder / "scores.csv", newline="") as file:
        rows = [row for row in csv.DictReader(file) if not names or row["volume"] in names]
    volumes = [row for row in rows if row["rule"] in ("h-maxima", "spacing")]
    specimens = [row for row in rows if row["rule"] == "auto"]
    if volumes:
        print("| volume | seeds | found (true) | matched | PQ (ours) | Dice (ours) | right (ours) | D50 (ours) | s (ours) |")
        print("|---|---|---|---|---|---|---|---|---|")
    for row in volumes:
        volume_row(folder, row["volume"], row["rule"], row)
    if volumes:
        print(f"peak of memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000:.0f} MB")
    if specimens:
        print("| specimen | grains | fraction | PQ: ours | multi-Otsu | inside | fraction: ours | multi-Otsu | inside | median volume: ours | multi-Otsu | inside |")
        print("|" + "---|" * 12)
    for row in specimens:
        specimen_row(folder, row["volume"], row)


main()
