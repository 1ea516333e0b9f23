"""What the programs that render for race.py and coverage.py share: their arguments, and how many samples they take."""
import argparse
import json
import sys

import numpy as np


def arguments(settings):
    own = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else sys.argv[1:]
    parser = argparse.ArgumentParser()
    parser.add_argument("scene")
    parser.add_argument("setting", choices=settings)
    parser.add_argument("--seconds", type=float, default=5)
    parser.add_argument("--spp", type=int, help="samples a pixel, in place of --seconds")
    parser.add_argument("--first-seed", type=int, default=100)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--out", required=True)
    return parser.parse_args(own)


def run(args, render):
    """Renders args.seeds images of args.spp samples, or of the number of samples that takes args.seconds.

    `render(spp, seed)` returns the image (height, width, 3; top row first), its samples a pixel, and the seconds that it
    took. Writes OUT.SEED.npy, and prints a line of JSON for each image.
    """
    render(1, 0)
    spp = args.spp or 4
    while not args.spp:
        render(spp, 0)
        _, _, took = render(spp, 1)
        if took > 0.8 * args.seconds:
            break
        spp = max(spp + 1, int(spp * min(0.95 * args.seconds / max(took, 1e-3), 8)))
    for seed in range(args.seeds):
        image, count, seconds = render(spp, args.first_seed + seed)
        np.save(f"{args.out}.{seed}.npy", image)
        print(json.dumps({"spp": count, "seconds": seconds}), flush=True)
