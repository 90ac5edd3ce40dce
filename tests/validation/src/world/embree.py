"""Embree on a list of triangles, through the Python package embreex.

    embree.py unpack SCENE.npz TRIANGLES     the triangles of a scene, and whether each is ground
    embree.py cast TRIANGLES RAYS DISTANCES  a round for every line of standard input; prints its CPU time in s

Triangles: nine doubles each; rays: origin and direction, six doubles; distances: a double each, inf where nothing is met.
"""
import sys
import time

import numpy as np


def unpack(scene, triangles):
    data = np.load(scene)
    corners = data["V"].astype(np.float64)[data["F"]]
    ground = data["owner"] == -1
    np.concatenate([corners[ground], corners[~ground]]).tofile(triangles)
    x, y = data["c"]
    print("RESULT", int(ground.sum()), float(x), float(y))


def cast(triangles, rays, distances):
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    corners = np.fromfile(triangles).reshape(-1, 3, 3).astype(np.float32)
    numbers = np.fromfile(rays).reshape(-1, 6).astype(np.float32)
    origins, directions = np.ascontiguousarray(numbers[:, :3]), np.ascontiguousarray(numbers[:, 3:])
    scene = EmbreeScene()
    mesh = TriangleMesh(scene, corners)
    found = scene.run(origins, directions, query="DISTANCE")
    found = np.where(found > 1e30, np.inf, found).astype(np.float64)
    found.tofile(distances)
    print("RESULT ready", flush=True)
    for _ in sys.stdin:
        start = time.thread_time()
        scene.run(origins, directions, query="DISTANCE")
        print("RESULT", time.thread_time() - start, flush=True)
    del mesh


{"unpack": unpack, "cast": cast}[sys.argv[1]](*sys.argv[2:])
