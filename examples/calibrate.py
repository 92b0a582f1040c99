"""Intrinsics of a camera from pictures of a ChArUco board.

    pip install opencv-python-headless
    python examples/calibrate.py --print-board board.png          # print it, glue it on something flat
    python examples/calibrate.py PICTURES --square-mm 30 --output camera.yaml
    groundloop camera images PICTURES --run NAME --intrinsics camera.yaml --pose=…

Take 15 pictures or more, with the size and focus that the camera will have, the board near and far, tilted
to every side, and in every corner of the picture. `camera.yaml` is what ROS calls a camera_info file.

    python examples/calibrate.py --self-test                      # needs no camera

draws boards as a known camera sees them and says how far off the calibration of them is.
"""

import argparse
import pathlib
import sys
import tempfile

try:
    import cv2
    import numpy as np
except ImportError as error:
    print(f"{error}: pip install opencv-python-headless", file=sys.stderr)
    sys.exit(5)

ENDINGS = {".jpg", ".jpeg", ".png"}
# Fewer corners in a picture say too little of where its board is.
CORNERS_MIN = 8
PICTURES_MIN = 5


def board_of(args):
    """The board that the flags say, with squares of 1 unless their side is said."""
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, args.dictionary))
    square = args.square_mm / 1000
    size = (args.columns, args.rows)
    return cv2.aruco.CharucoBoard(size, square, square * args.marker_share, dictionary)


def corners_of(board, paths):
    """The corners of the board in each picture that shows enough of them, and the size of all."""
    detector = cv2.aruco.CharucoDetector(board)
    size, object_points, image_points, used = None, [], [], []
    for path in paths:
        grey = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        if grey is None:
            sys.exit(f"{path}: no picture")
        if size not in (None, grey.shape[::-1]):
            sys.exit(f"{path}: expected {size[0]}x{size[1]} pixels like the others, got {grey.shape[1]}x{grey.shape[0]}")
        size = grey.shape[::-1]
        corners, ids, _, _ = detector.detectBoard(grey)
        n = 0 if ids is None else len(ids)
        if n < CORNERS_MIN:
            print(f"{path}: {n} corners, {CORNERS_MIN} are needed: left out", file=sys.stderr)
            continue
        on_board, in_picture = board.matchImagePoints(corners, ids)
        object_points.append(on_board)
        image_points.append(in_picture)
        used.append(path)
    if len(used) < PICTURES_MIN:
        sys.exit(f"{len(used)} pictures show the board, {PICTURES_MIN} are needed; is --columns, --rows, --dictionary as printed?")
    return size, object_points, image_points, used


def calibrate(size, object_points, image_points):
    """Root mean square of the reprojection error in pixels, camera matrix, and plumb_bob coefficients."""
    error_px, matrix, lens, _, _ = cv2.calibrateCamera(object_points, image_points, size, None, None)
    return error_px, matrix, lens.ravel()[:5]


def camera_info(name, size, matrix, lens, error_px, n_pictures):
    """The calibration as ROS's camera_calibration writes it."""

    def rows(rows, columns, values):
        listed = ", ".join(f"{value:.9g}" for value in np.asarray(values).ravel())
        return f"\n  rows: {rows}\n  cols: {columns}\n  data: [{listed}]"

    projection = np.hstack([matrix, np.zeros((3, 1))])
    return (
        f"# {n_pictures} pictures, reprojection error {error_px:.3f} pixels (root mean square)\n"
        f"image_width: {size[0]}\nimage_height: {size[1]}\ncamera_name: {name}\n"
        f"camera_matrix:{rows(3, 3, matrix)}\n"
        f"distortion_model: plumb_bob\ndistortion_coefficients:{rows(1, len(lens), lens)}\n"
        f"rectification_matrix:{rows(3, 3, np.eye(3))}\nprojection_matrix:{rows(3, 4, projection)}\n"
    )


def draw(board, matrix, lens, size, pose, scale=12):
    """The board as a camera sees it: each pixel looks along its bent ray onto the plane of the board."""
    columns, rows = board.getChessboardSize()
    square = board.getSquareLength()
    flat = board.generateImage((columns * 20 * scale, rows * 20 * scale))
    width, height = size
    pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1).reshape(-1, 1, 2)
    rays = cv2.undistortPoints(pixels.astype(np.float64), matrix, lens).reshape(-1, 2)
    turn, shift = pose
    plane = np.column_stack([cv2.Rodrigues(turn)[0][:, :2], shift])
    on_board = np.linalg.solve(plane, np.column_stack([rays, np.ones(len(rays))]).T)
    at = (on_board[:2] / on_board[2] / square * 20 * scale - 0.5).T.reshape(height, width, 2)
    at = at.astype(np.float32)
    # Averaged over what a pixel covers, about `scale` / 4 pixels of the flat board.
    flat = cv2.GaussianBlur(flat, (0, 0), scale / 3)
    return cv2.remap(flat, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderValue=160)


def self_test(args):
    """Draws boards as a known camera sees them, and calibrates it from the pictures."""
    matrix = np.array([[612.0, 0, 325.5], [0, 608.0, 236.0], [0, 0, 1]])
    lens = np.array([-0.12, 0.05, 0.001, -0.0005, 0.0])
    size, board, draws = (640, 480), board_of(args), np.random.default_rng(7)
    columns, rows = board.getChessboardSize()
    middle = np.array([columns, rows]) * board.getSquareLength() / 2
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for i in range(20):
            turn = draws.uniform([-0.6, -0.6, -0.5], [0.6, 0.6, 0.5])
            distance = draws.uniform(1.4, 2.6) * max(columns, rows) * board.getSquareLength()
            across = draws.uniform([-0.28, -0.2], [0.28, 0.2]) * distance
            shift = np.array([*across, distance]) - cv2.Rodrigues(turn)[0] @ np.array([*middle, 0])
            cv2.imwrite(str(folder / f"{i:02}.png"), draw(board, matrix, lens, size, (turn, shift)))
        size, object_points, image_points, used = corners_of(board, sorted(folder.iterdir()))
        error_px, found, found_lens = calibrate(size, object_points, image_points)
    off = np.abs(found - matrix)
    print(f"{len(used)} pictures, reprojection error {error_px:.3f} pixels (root mean square)")
    print(f"off: fx {off[0, 0]:.2f}, fy {off[1, 1]:.2f}, cx {off[0, 2]:.2f}, cy {off[1, 2]:.2f} pixels")
    corners = np.array([[[0.0, 0.0]], [[639.0, 0.0]], [[0.0, 479.0]], [[639.0, 479.0]]])
    rays = cv2.undistortPoints(corners, matrix, lens)
    again = cv2.projectPoints(np.dstack([rays, np.ones((4, 1))]), np.zeros(3), np.zeros(3), found, found_lens)[0]
    print(f"off in a corner: {np.abs(again - corners).max():.2f} pixels at most")
    return 0 if error_px < 0.5 and off.max() < 5 else 1


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pictures", nargs="?", help="a folder of pictures (jpg, png)")
    parser.add_argument("--output", default="camera.yaml", help="the file to write (camera.yaml)")
    parser.add_argument("--name", default="camera", help="camera_name in the file")
    parser.add_argument("--columns", type=int, default=7, help="squares of the board from left to right (7)")
    parser.add_argument("--rows", type=int, default=5, help="squares of the board from top to bottom (5)")
    parser.add_argument("--square-mm", type=float, default=30.0, help="side of a square (30); of no effect on intrinsics")
    parser.add_argument("--marker-share", type=float, default=0.75, help="side of a marker in shares of a square (0.75)")
    parser.add_argument("--dictionary", default="DICT_5X5_100", help="markers of the board (DICT_5X5_100)")
    parser.add_argument("--print-board", metavar="FILE", help="draw the board instead")
    parser.add_argument("--self-test", action="store_true", help="calibrate from drawn pictures instead")
    args = parser.parse_args()
    if args.self_test:
        return self_test(args)
    if args.print_board:
        board = board_of(args)
        cv2.imwrite(args.print_board, board.generateImage((args.columns * 300, args.rows * 300)))
        return 0
    if args.pictures is None:
        parser.error("expected a folder of pictures")
    paths = sorted(path for path in pathlib.Path(args.pictures).iterdir() if path.suffix.lower() in ENDINGS)
    size, object_points, image_points, used = corners_of(board_of(args), paths)
    error_px, matrix, lens = calibrate(size, object_points, image_points)
    text = camera_info(args.name, size, matrix, lens, error_px, len(used))
    pathlib.Path(args.output).write_text(text)
    print(f"{args.output}: {len(used)} pictures, reprojection error {error_px:.3f} pixels (root mean square)")
    return 0


if __name__ == "__main__":
    sys.exit(main())
