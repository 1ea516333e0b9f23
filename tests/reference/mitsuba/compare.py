"""Compares an image (PFM, or .npy) with a reference.

    python3 compare.py image.pfm cornell_box     # reads cornell_box.a.npy and cornell_box.b.npy

Prints, by channel:

* the ratio of the means
* the relative mean squared error, without the noise of the reference (from its two halves) and, with a second image of
  another seed, without the image's own noise
* the worst ratios of 8x8 blocks, with their place and their deviation in standard deviations of noise
"""
import sys

import numpy as np

BLOCK = 8


def read(path):
    if path.endswith(".npy"):
        return np.load(path).astype(np.float64)
    with open(path, "rb") as file:
        data = file.read()
    parts = data.split(maxsplit=4)
    width, height, scale = int(parts[1]), int(parts[2]), float(parts[3])
    channels = {b"PF": 3, b"Pf": 1}[parts[0]]
    raw = np.frombuffer(data[-4 * width * height * channels:], "<f4" if scale < 0 else ">f4")
    image = raw.reshape(height, width, channels)[::-1].astype(np.float64)
    return np.broadcast_to(image, (height, width, 3))


def blocks(image):
    h, w = image.shape[0] // BLOCK * BLOCK, image.shape[1] // BLOCK * BLOCK
    return image[:h, :w].reshape(h // BLOCK, BLOCK, w // BLOCK, BLOCK, 3).mean((1, 3))


def main():
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    image = read(sys.argv[1])
    a, b = (np.load(f"{sys.argv[2]}.{half}.npy").astype(np.float64) for half in "ab")
    reference = (a + b) / 2
    if image.shape != reference.shape:
        sys.exit(f"{image.shape[1]}x{image.shape[0]} against {reference.shape[1]}x{reference.shape[0]}")
    if not np.isfinite(image).all():
        sys.exit("not finite")
    noise = (a - b) ** 2 / 4  # of the mean of the two halves
    if len(sys.argv) == 4:
        second = read(sys.argv[3])
        noise = noise + (image - second) ** 2 / 4
        image = (image + second) / 2
    weight = 1 / (reference ** 2 + (0.01 * reference.mean()) ** 2)
    error = (image - reference) ** 2
    ratio = image.mean((0, 1)) / reference.mean((0, 1))
    # The standard deviation of the mean.
    sigma = np.sqrt(noise.sum((0, 1))) / noise[..., 0].size / reference.mean((0, 1))
    print("mean ratio      " + "  ".join(f"{r:.5f} ± {s:.5f}" for r, s in zip(ratio, sigma)))
    print(f"relMSE          {(error * weight).mean():.3e}")
    print(f"  of noise      {(noise * weight).mean():.3e}" + ("" if len(sys.argv) == 4 else " (the reference's only)"))
    print(f"  without noise {((error - noise) * weight).mean():.3e}")
    bi, br = blocks(image), blocks(reference)
    deviation = np.sqrt(blocks(noise) / BLOCK ** 2)
    # A block's noise is estimated from 64 differences. It is at least half the median, so that a low estimate gives no false alarm.
    floor = np.median(deviation / br, axis=(0, 1)) / 2 * br
    off = (bi - br) / np.maximum(deviation, floor)
    for title, key in (("worst ratio", np.abs(np.log(np.maximum(bi, 1e-9) / np.maximum(br, 1e-9)))), ("most sigmas", np.abs(off))):
        y, x, c = np.unravel_index(np.argmax(key), key.shape)
        print(f"{title}     {bi[y, x, c] / br[y, x, c]:.4f} ({off[y, x, c]:+.1f} sigma), channel {'RGB'[c]}, "
              f"block of row {y * BLOCK}, column {x * BLOCK}, {br[y, x, c]:.4g} there")


main()
