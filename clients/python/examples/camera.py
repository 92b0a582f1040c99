"""A camera of your own: publishes the picture of a file, ten times a second.

python3 camera.py RUN PICTURE.png      (pip install pillow)
"""

import sys
import time

import numpy as np
from PIL import Image

import groundloop


def main(run: str, picture: str) -> None:
    rgb = np.array(Image.open(picture).convert("RGB"))
    camera = groundloop.Camera(run)
    while True:
        camera.publish(rgb)
        time.sleep(0.1)


if __name__ == "__main__":
    main(*sys.argv[1:])
