"""Takes what LeRobot's data set class takes, and refuses what that refuses, as its pages and its source of 0.4 to 0.6 were read: a folder that is
there, keys that LeRobot makes itself, another dtype or shape than was announced, a frame without a task, an episode without a frame, and reading
what was not finalized. It keeps NumPy files, so nothing is learnt here of LeRobot's own files.

VEST_STAND_IN=spoil changes a number on the way, as a writer with a fault."""
import json
import os
import pickle

import numpy as np

MADE = ("timestamp", "frame_index", "episode_index", "index", "task_index")


class LeRobotDataset:
    def __init__(self, repo_id, root=None):
        with open(os.path.join(root, "meta", "info.json"), encoding="utf-8") as file:
            self.info = json.load(file)
        with open(os.path.join(root, "data", "episodes.pickle"), "rb") as file:
            episodes = pickle.load(file)
        self.repo_id, self.num_episodes = repo_id, len(episodes)
        self.rows = {}
        for number, (frames, task) in enumerate(episodes):
            for k, frame in enumerate(frames):
                for name, value in {**frame, "timestamp": np.float32(k / self.info["fps"]), "episode_index": number, "task": task}.items():
                    is_double = isinstance(value, np.ndarray) and value.dtype == np.float64  # it becomes torch's float32
                    self.rows.setdefault(name, []).append(value.astype(np.float32) if is_double else value)

    def __len__(self):
        return len(self.rows["task"])

    @property
    def hf_dataset(self):
        return self

    def __getitem__(self, which):
        return {name: values[which] for name, values in self.rows.items()}

    @classmethod
    def create(cls, repo_id, fps, features, root=None, robot_type=None, use_videos=True):
        assert isinstance(fps, int) and fps > 0, fps
        assert not set(features) & set(MADE) and not any("/" in name for name in features), features
        assert use_videos == any(f["dtype"] == "video" for f in features.values())
        self = cls.__new__(cls)
        self.root, self.features, self.frames, self.episodes = root, features, [], []
        self.info = {"codebase_version": "v3.0", "fps": fps, "robot_type": robot_type, "features": features}
        os.mkdir(root)
        return self

    def add_frame(self, frame):
        task = frame.pop("task")
        assert isinstance(task, str) and task
        assert set(frame) == set(self.features), set(frame) ^ set(self.features)
        for name, value in frame.items():
            asked = self.features[name]
            kind = np.dtype(np.uint8 if asked["dtype"] == "video" else asked["dtype"])
            assert isinstance(value, np.ndarray), (name, type(value))
            assert (value.dtype, value.shape) == (kind, asked["shape"]), (name, value.dtype, value.shape, asked)
        self.frames.append((dict(frame), task))

    def save_episode(self):
        assert self.frames, "an episode has a frame"
        tasks = {task for _, task in self.frames}
        self.episodes.append(([frame for frame, _ in self.frames], tasks.pop()))
        self.frames = []

    def finalize(self):
        assert not self.frames, "an episode was not saved"
        if os.environ.get("VEST_STAND_IN") == "spoil":
            state = self.episodes[-1][0][-1]["observation.state"]
            state[2] = np.nextafter(state[2], np.float32(1))
        for folder in ("meta", "data"):
            os.mkdir(os.path.join(self.root, folder))
        with open(os.path.join(self.root, "data", "episodes.pickle"), "wb") as file:
            pickle.dump(self.episodes, file)
        with open(os.path.join(self.root, "meta", "info.json"), "w", encoding="utf-8") as file:
            json.dump(self.info, file)
