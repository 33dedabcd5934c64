"""scikit-image on the volumes of `cargo run --release -p fem-mesh --example segmentation FOLDER`, scored in the
same way, with the seconds of processor time that it takes.

    python3 segmentation.py FOLDER

Needs numpy, scipy, scikit-image and tifffile. The chain is the usual one: median 3³, multi-Otsu, the
Euclidean distance, a Gaussian of 1 voxel, h-maxima of 0.5 voxel (or peaks 4 voxels apart on distances in
whole voxels, the paper's rule), watershed. Beam hardening is not taken out.
"""
import sys
import time
from pathlib import Path

import numpy as np
import scipy.ndimage as ndi
from skimage.feature import peak_local_max
from skimage.filters import threshold_multiotsu
from skimage.morphology import h_maxima
from skimage.segmentation import watershed
from tifffile import imread

LEAST = 30  # voxels


def seeds_of(distance, rule):
    if rule == "h-maxima":
        smooth = ndi.gaussian_filter(distance, 1.0)
        return smooth, ndi.label(h_maxima(smooth, 0.5), np.ones((3, 3, 3)))[0]
    whole = np.floor(distance)
    peaks = peak_local_max(whole, min_distance=4, labels=(distance > 0).astype(int))
    seeds = np.zeros(distance.shape, int)
    seeds[tuple(peaks.T)] = np.arange(1, len(peaks) + 1)
    return whole, seeds


def segment(image, rule):
    smooth = ndi.median_filter(image, 3)
    grain = smooth >= threshold_multiotsu(smooth, 3, nbins=1024)[1]
    distance = ndi.distance_transform_edt(grain)
    height, seeds = seeds_of(distance, rule)
    labels = watershed(-height, seeds, mask=grain)
    sizes = np.bincount(labels.ravel())
    kept = sizes >= LEAST
    kept[0] = False
    numbers = np.cumsum(kept) * kept
    return numbers[labels]


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
    return *grains, matched.sum(), quality, dice


def d50(labels):
    sizes = np.sort(np.bincount(labels.ravel())[1:])
    middle = np.searchsorted(np.cumsum(sizes), sizes.sum() / 2)
    return (6 * sizes[middle] / np.pi) ** (1 / 3)


def main():
    folder = Path(sys.argv[1])
    print("volume     rule     grains found matched     PQ   Dice  D50 error  seconds")
    for name in ("separate", "touching", "fines", "scanned", "rough"):
        if not (folder / f"{name}.tif").exists():
            continue
        image, truth = imread(folder / f"{name}.tif"), imread(folder / f"{name}-truth.tif")
        for rule in ("h-maxima", "spacing"):
            start = time.process_time()
            found = segment(image, rule)
            seconds = time.process_time() - start
            true, count, matched, quality, dice = score(truth, found)
            print(
                f"{name:10} {rule:9}{true:6} {count:5} {matched:7} {quality:6.4f} {dice:6.4f}"
                f" {d50(found) / d50(truth) - 1:+10.4f} {seconds:8.1f}"
            )


main()
