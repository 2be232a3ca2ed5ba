"""Records ball.bag: record.py FILE, with pyrealsense2 2.56.5, the last version that records `.bag`.

A software device shows the paper's ball at its target to the camera of `host/rigs/camera.toml`, in
front of a wall. The depth sensor is 50 mm to the left of the colour sensor.
"""

import sys
import time

import numpy as np
import pyrealsense2 as rs

# Columns and rows of the pictures, and focal length, pixels.
WIDTH, HEIGHT, FOCAL = 640, 480, 525.0
# Distance of the depth sensor to the left of the colour sensor, metres.
BASELINE = 0.05
# Centre of the ball in the axes of the colour sensor, and its radius, metres.
CENTRE, RADIUS = np.array([0.114, 0.075, 1.337]), 0.04
# Depth of the wall, metres, and a unit of depth, metres.
WALL, UNIT = 2.2, 0.001
# Number of pairs, and pictures a second.
PAIRS, RATE = 6, 30


def depth_and_normals(centre):
    """Returns the depth of the wall with a ball at `centre`, metres, the part of the light that the
    ball reflects to the camera (0 to 1), and where the ball is."""
    u, v = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    rays = np.stack([(u - 319.5) / FOCAL, (v - 239.5) / FOCAL, np.ones_like(u, float)], -1)
    along, square = rays @ centre, (rays**2).sum(-1)
    root = along**2 - square * (centre @ centre - RADIUS**2)
    is_ball = root > 0
    depth = np.where(is_ball, (along - np.sqrt(np.maximum(root, 0))) / square, WALL)
    normals = (rays * depth[..., None] - centre) / RADIUS
    light = np.clip(-(normals * rays).sum(-1) / np.sqrt(square), 0, 1)
    return depth, light, is_ball


def colour_picture():
    """Returns 8-bit red, green and blue."""
    _, light, is_ball = depth_and_normals(CENTRE)
    ball = np.array([200, 25, 30]) * (0.3 + 0.7 * light[..., None])
    return np.where(is_ball[..., None], ball, [120, 125, 130]).astype(np.uint8)


def depth_picture():
    """Returns depths in units, in the pixels of the depth sensor."""
    depth, _, _ = depth_and_normals(CENTRE + [BASELINE, 0, 0])
    return np.rint(depth / UNIT).astype(np.uint16).view(np.uint8).reshape(HEIGHT, WIDTH, 2)


def intrinsics():
    """Returns the intrinsics of both sensors."""
    lens = rs.intrinsics()
    lens.width, lens.height, lens.fx, lens.fy = WIDTH, HEIGHT, FOCAL, FOCAL
    lens.ppx, lens.ppy, lens.model, lens.coeffs = 319.5, 239.5, rs.distortion.none, [0] * 5
    return lens


def add_stream(sensor, kind, number, pixel, form):
    """Adds a stream with `pixel` bytes a pixel to a sensor."""
    stream = rs.video_stream()
    stream.type, stream.index, stream.uid, stream.fmt, stream.bpp = kind, 0, number, form, pixel
    stream.width, stream.height, stream.fps, stream.intrinsics = WIDTH, HEIGHT, RATE, intrinsics()
    return sensor.add_video_stream(stream)


def send(sensor, profile, pixels, number):
    """Sends a picture."""
    frame = rs.software_video_frame()
    frame.pixels, frame.bpp, frame.stride = pixels, pixels.shape[2], pixels.shape[2] * WIDTH
    frame.timestamp, frame.domain = 1e6 + 1e3 * number / RATE, rs.timestamp_domain.hardware_clock
    frame.frame_number, frame.profile = number, profile.as_video_stream_profile()
    frame.depth_units = UNIT
    sensor.on_video_frame(frame)


def main(path):
    """Records the file."""
    device = rs.software_device()
    depth, colour = device.add_sensor("Stereo Module"), device.add_sensor("RGB Camera")
    depths = add_stream(depth, rs.stream.depth, 1, 2, rs.format.z16)
    colours = add_stream(colour, rs.stream.color, 2, 3, rs.format.rgb8)
    depth.add_read_only_option(rs.option.depth_units, UNIT)
    pose = rs.extrinsics()
    pose.rotation, pose.translation = [1, 0, 0, 0, 1, 0, 0, 0, 1], [-BASELINE, 0, 0]
    depths.register_extrinsics_to(colours, pose)
    recorder, queue = rs.recorder(path, device), rs.frame_queue(2 * PAIRS)
    sensors = recorder.query_sensors()
    for sensor in sensors:
        sensor.open(sensor.get_stream_profiles()[0])
        sensor.start(queue)
    # The library reads the pixels later: they stay until the end.
    pictures = [(colour, colours, colour_picture()), (depth, depths, depth_picture())]
    for number in range(PAIRS):
        for sensor, profile, pixels in pictures:
            send(sensor, profile, pixels, number)
        time.sleep(1 / RATE)
    for sensor in sensors:
        sensor.stop()
        sensor.close()


main(sys.argv[1])
