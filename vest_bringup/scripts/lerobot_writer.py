#!/usr/bin/env python3
"""Writes a data set of LeRobot, format version 3, from the tables that vest_export hands over. All files are LeRobot's own work.

usage: lerobot_writer.py ANSWER              whether this Python has LeRobot
       lerobot_writer.py ANSWER REQUEST      writes, reads back, compares

REQUEST is a JSON file. `root` is a folder that is not there yet, `work` one for what is not kept. `fps` is frames a second; `repo_id` and
`robot_type` are LeRobot's. `state` and `action` are names of columns. `picture` is null, or rows and columns in pixels. `episodes` each have
frames, table (a file), task (words) and pictures (PNG files, one per frame). A table is little-endian float64. A row per frame has simulated time
in s, reward, state, action.

ANSWER becomes a JSON file: {"lerobot": version, "format": version} or {"error": one sentence}. Exit status 0, or 2 with an error.

Needs LeRobot 0.4 and later, which writes format 3. It is imported here alone, so this file runs in any Python that has it, without ROS."""
import json
import os
import sys


def load():
    """@return LeRobotDataset, version of LeRobot  @raise RuntimeError saying what to install"""
    wanted = "install LeRobot 0.4 or later there (pip install lerobot), or name a Python that has it with --python"
    try:
        from lerobot.datasets.lerobot_dataset import LeRobotDataset
    except Exception as error:  # an import runs any code: whatever it raises, LeRobot is not usable
        raise RuntimeError("%s cannot import lerobot (%s): %s" % (sys.executable, error, wanted)) from error
    if not hasattr(LeRobotDataset, "finalize"):
        raise RuntimeError("%s has a LeRobot that does not write format 3: %s" % (sys.executable, wanted))
    try:
        from importlib.metadata import version
        return LeRobotDataset, version("lerobot")
    except Exception:
        return LeRobotDataset, "unknown"


def features(request):
    """Columns of the data set. LeRobot adds timestamp, frame_index, episode_index, index and task_index."""
    columns = {
        "observation.state": {"dtype": "float32", "shape": (len(request["state"]),), "names": request["state"]},
        "action": {"dtype": "float32", "shape": (len(request["action"]),), "names": request["action"]},
        "next.reward": {"dtype": "float32", "shape": (1,), "names": None},
        "next.done": {"dtype": "bool", "shape": (1,), "names": None},
        "simulated_time": {"dtype": "float64", "shape": (1,), "names": None},
    }
    if request["picture"]:
        columns["observation.images.endoscope"] = {
            "dtype": "video", "shape": (*request["picture"], 3), "names": ["height", "width", "channels"]}
    return columns


def tables(request, episode):
    """Columns of an episode by name, frames × width each."""
    import numpy as np

    state, action = len(request["state"]), len(request["action"])
    numbers = np.fromfile(episode["table"], "<f8").reshape(episode["frames"], 2 + state + action)
    done = np.zeros((episode["frames"], 1), bool)
    done[-1] = True
    return {
        "simulated_time": numbers[:, 0:1],
        "next.reward": numbers[:, 1:2].astype(np.float32),
        "observation.state": numbers[:, 2:2 + state].astype(np.float32),
        "action": numbers[:, 2 + state:].astype(np.float32),
        "next.done": done,
    }


def write(dataset_class, request):
    data = dataset_class.create(repo_id=request["repo_id"], fps=request["fps"], features=features(request), root=request["root"],
                                robot_type=request["robot_type"], use_videos=bool(request["picture"]))
    for episode in request["episodes"]:
        columns = tables(request, episode)
        for k in range(episode["frames"]):
            frame = {name: column[k] for name, column in columns.items()}
            if request["picture"]:
                frame["observation.images.endoscope"] = picture(episode["pictures"][k], request["picture"])
            data.add_frame({**frame, "task": episode["task"]})
        data.save_episode()
    data.finalize()


def picture(file, size):
    import numpy as np
    from PIL import Image

    with Image.open(file) as image:
        pixels = np.array(image.convert("RGB"))
    if pixels.shape[:2] != tuple(size):
        raise RuntimeError("%s: %d rows of %d pixels, not %d of %d" % (file, *pixels.shape[:2], *size))
    return pixels


def compare(dataset_class, request):
    """Reads what lies there as a user does. @raise RuntimeError where a number is not what was handed over"""
    import numpy as np

    data = dataset_class(request["repo_id"], root=request["root"])
    frames = sum(episode["frames"] for episode in request["episodes"])
    if (len(data), data.num_episodes) != (frames, len(request["episodes"])):
        raise RuntimeError("read back: %d frames in %d episodes, written: %d in %d"
                           % (len(data), data.num_episodes, frames, len(request["episodes"])))
    first = 0
    for number, episode in enumerate(request["episodes"]):
        rows = data.hf_dataset[first:first + episode["frames"]]
        for name, column in tables(request, episode).items():
            back = np.stack([np.asarray(value) for value in rows[name]]).reshape(column.shape)
            # LeRobot hands out float64 as float32.
            if not np.array_equal(back.astype(np.float32), column.astype(np.float32)):
                raise RuntimeError("read back: %s of episode %d has other numbers" % (name, number))
        times = np.stack([np.asarray(value) for value in rows["timestamp"]]).reshape(-1)
        if not np.allclose(times, np.arange(episode["frames"]) / request["fps"], rtol=1e-6, atol=0):  # float32
            raise RuntimeError("read back: episode %d has other timestamps" % number)
        first += episode["frames"]


def offline(folder):
    """Nothing is asked of a network, and caches go where they are deleted."""
    os.environ.update(HF_HUB_OFFLINE="1", HF_DATASETS_OFFLINE="1", HF_HUB_DISABLE_TELEMETRY="1", HF_DATASETS_CACHE=os.path.join(folder, "datasets"),
                      HF_LEROBOT_HOME=os.path.join(folder, "lerobot"))


def main(answer_file, request_file=None):
    request = None
    if request_file:
        with open(request_file, encoding="utf-8") as file:
            request = json.load(file)
        offline(request["work"])
    answer, code = {}, 0
    try:
        dataset_class, answer["lerobot"] = load()
        if request:
            write(dataset_class, request)
            compare(dataset_class, request)
            with open(os.path.join(request["root"], "meta", "info.json"), encoding="utf-8") as file:
                answer["format"] = json.load(file)["codebase_version"]
    except Exception as error:  # of any library below: the caller says it in one line
        answer, code = {"error": " ".join(str(error).split()) or type(error).__name__}, 2
    with open(answer_file, "w", encoding="utf-8") as file:
        json.dump(answer, file)
    return code


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
