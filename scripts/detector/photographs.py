"""Writes photographs as a TUM RGB-D folder: photographs.py SET ROOT OUT

SET is `training`, `judging` or `test`. README.md has four groups of commands that train networks:
photographs of the set `training` are backgrounds in the groups 3 and 4, those of `judging` in the
group 4. No network is trained with those of the set `test`: they are a background for
`plumb-lab vision --suite rooms`. OUT is a new folder.

The photographs are those of the Debian packages opencv-doc (4.6.0) and python3-skimage (0.19.3);
for `training`, plasma-workspace-wallpapers (5.27.5) as well; for `judging`, palapeli-data
(22.12.3), lomiri-wallpapers-16.04 and lomiri-wallpapers-20.04 (20.04.0), mate-backgrounds (1.26.0)
and python3-sklearn (1.2.1). They are installed or unpacked in ROOT. They have no depth. Each one
gets that of a slope, from 3.4 m in the first row to 2.2 m in the last.
"""

import os
import sys

import cv2
import numpy as np

from light import TUM_DEPTH

EXAMPLES = "usr/share/doc/opencv-doc/examples/data"
MANUAL = "usr/share/doc/opencv-doc/opencv4/html"
SKIMAGE = "usr/lib/python3/dist-packages/skimage/data"
WALLPAPERS = "usr/share/wallpapers"


def wallpapers(size, names):
    """Returns the folder of wallpapers of a size and their names in it."""
    parts = (name.split(".") for name in names.split())
    return WALLPAPERS, " ".join(f"{name}/contents/images/{size}.{kind}" for name, kind in parts)


# Folder and names of the photographs of each set. No photograph is in two of the three sets. No
# person or thing is in a photograph of `training` and in one of `test`.
PHOTOGRAPHS = {
    "training": [
        (
            EXAMPLES,
            "aloeL.jpg board.jpg butterfly.jpg fruits.jpg leuvenA.jpg messi5.jpg smarties.png "
            "orange.jpg chicky_512.png graf1.png licenseplate_motion.jpg",
        ),
        (
            MANUAL,
            "plant.jpg choriginal.jpg budapest.jpg 230501201_1.jpg detect_test2.jpg 02.jpg",
        ),
        (SKIMAGE, "chelsea.png rocket.jpg motorcycle_right.png"),
        # Most wallpapers are in both sizes, with the same picture, and count twice.
        wallpapers(
            "1920x1080",
            "Autumn.jpg BytheWater.jpg ColdRipple.jpg DarkestHour.jpg EveningGlow.jpg "
            "FallenLeaf.jpg FlyingKonqui.png Grey.jpg Kite.jpg OneStandsOut.jpg PastelHills.jpg "
            "Path.jpg summer_1am.jpg",
        ),
        wallpapers(
            "2560x1600",
            "Autumn.jpg BytheWater.jpg ColdRipple.jpg ColorfulCups.jpg DarkestHour.jpg Elarun.png "
            "EveningGlow.jpg FallenLeaf.jpg FlyingKonqui.png Grey.jpg Kite.jpg OneStandsOut.jpg "
            "Path.jpg summer_1am.jpg",
        ),
    ],
    "judging": [
        (
            "usr/share/palapeli/collection",
            "cincinnati-bridge.jpg european-honey-bee.jpg panther-chameleon-female.jpg "
            "castle-maintenon.jpg citrus-fruits.jpg",
        ),
        (
            "usr/share/backgrounds",
            "Picture_1A_by_freespace.jpg Wine_by_Jakkub_Mede.jpg Picture_0B_by_freespace.jpg "
            "friends_by_Aitzol_Berasategi.jpg seeding_by_Clements_Engelhardt.jpg",
        ),
        (
            "usr/share/backgrounds/mate/nature",
            "Garden.jpg TwoWings.jpg FreshFlower.jpg LadyBird.jpg YellowFlower.jpg",
        ),
        ("usr/lib/python3/dist-packages/sklearn/datasets/images", "china.jpg flower.jpg"),
    ],
    "test": [
        (
            EXAMPLES,
            "baboon.jpg basketball1.png ela_original.jpg home.jpg rubberwhale1.png stuff.jpg "
            "apple.jpg aero1.jpg building.jpg cards.png squirrel_cls.jpg",
        ),
        (
            MANUAL,
            "corridor_fld.jpg astra_color.jpg yolo.jpg newspaper.jpg 227943776_1.jpg 01.jpg",
        ),
        (SKIMAGE, "coffee.png astronaut.png"),
    ],
}
COLUMNS, ROWS = 640, 480
# Depth of the first row and of the last one, metres.
FAR, NEAR = 3.4, 2.2
# Photographs that are reduced by more than this factor also give a part at a larger scale.
LARGE, PART = 0.7, 1.6


def read(path):
    """Returns a photograph."""
    photograph = cv2.imread(path)
    if photograph is None:
        sys.exit(f"cannot read {path}: unpack the packages that photographs.py names in ROOT")
    return photograph


def scaled(photograph, factor):
    """Returns a photograph in another size."""
    method = cv2.INTER_AREA if factor < 1 else cv2.INTER_CUBIC
    return cv2.resize(photograph, None, fx=factor, fy=factor, interpolation=method)


def pictures(photograph):
    """Yields pictures of COLUMNS x ROWS: the middle, a lower left part of a large one, the middle
    mirrored."""
    rows, columns = photograph.shape[:2]
    factor = max(COLUMNS / columns, ROWS / rows)
    whole = scaled(photograph, factor)
    top, left = (whole.shape[0] - ROWS) // 2, (whole.shape[1] - COLUMNS) // 2
    middle = whole[top : top + ROWS, left : left + COLUMNS]
    yield middle
    if factor < LARGE:
        yield scaled(photograph, min(1, PART * factor))[-ROWS:, :COLUMNS]
    yield middle[:, ::-1]


def main():
    chosen, root, out = sys.argv[1:]
    if chosen not in PHOTOGRAPHS:
        sys.exit(f"there is no set {chosen}: give one of {', '.join(PHOTOGRAPHS)}")
    if os.path.exists(out):
        sys.exit(f"{out} exists: give the name of a new folder")
    slope = np.linspace(FAR, NEAR, ROWS)[:, None] * np.ones((1, COLUMNS))
    made = [
        picture
        for folder, names in PHOTOGRAPHS[chosen]
        for name in names.split()
        for picture in pictures(read(f"{root}/{folder}/{name}"))
    ]
    lists = {folder: "# timestamp path\n" for folder in ("rgb", "depth")}
    for folder in lists:
        os.makedirs(f"{out}/{folder}")
    for number, picture in enumerate(made, 1):
        for folder, image in [("rgb", picture), ("depth", (slope * TUM_DEPTH).astype(np.uint16))]:
            cv2.imwrite(f"{out}/{folder}/{number:06}.png", image)
            lists[folder] += f"{(number - 1) / 30:.6f} {folder}/{number:06}.png\n"
    for folder, lines in lists.items():
        with open(f"{out}/{folder}.txt", "w", encoding="ascii") as file:
            file.write(lines)


if __name__ == "__main__":
    main()
