#!/usr/bin/env python3
"""LPIPS end to end on made-up weights: .pth files of both kinds, the converter, evaluate, against numpy."""
import collections
import io
import json
import pathlib
import pickle
import shutil
import struct
import subprocess
import sys
import types
import zipfile

import common

common.need("cv2", "numpy")
import cv2
import numpy as np
import lpips_numpy

ROOT = pathlib.Path(__file__).resolve().parents[2]
FIXTURE = ROOT / "tests" / "data" / "evaluate"
CONVERT = ROOT / "tools" / "lpips_convert.py"


class FloatStorage:
    """Stands for torch.FloatStorage in a pickle."""

    def __init__(self, key, values):
        self.key, self.values = key, values


FloatStorage.__module__ = "torch"


def _rebuild_tensor_v2(*_):
    raise AssertionError("only its name is pickled")


_rebuild_tensor_v2.__module__ = "torch._utils"


class Tensor:
    def __init__(self, storage, offset, array):
        self.storage, self.offset, self.shape = storage, offset, array.shape
        self.stride = tuple(s // 4 for s in np.ascontiguousarray(array).strides)

    def __reduce__(self):
        return _rebuild_tensor_v2, (self.storage, self.offset, self.shape, self.stride, False, collections.OrderedDict())


class Pickler(pickle.Pickler):
    legacy = False

    def persistent_id(self, obj):
        if not isinstance(obj, FloatStorage):
            return None
        pid = ("storage", FloatStorage, obj.key, "cpu", obj.values.size)
        return pid + (None,) if self.legacy else pid


def with_torch_names(function):
    """Runs function while pickle can find the names of torch."""
    torch, utils = types.ModuleType("torch"), types.ModuleType("torch._utils")
    torch.FloatStorage, utils._rebuild_tensor_v2, torch._utils = FloatStorage, _rebuild_tensor_v2, utils
    saved = {n: sys.modules.get(n) for n in ("torch", "torch._utils")}
    sys.modules.update({"torch": torch, "torch._utils": utils})
    try:
        return function()
    finally:
        for name, module in saved.items():
            if module is None:
                del sys.modules[name]
            else:
                sys.modules[name] = module


def dump(obj, legacy):
    stream = io.BytesIO()
    pickler = Pickler(stream, protocol=2)
    pickler.legacy = legacy
    with_torch_names(lambda: pickler.dump(obj))
    return stream.getvalue()


def state_of(arrays):
    """A state dict and its storages; two tensors share a storage, so that offsets matter."""
    state, storages = collections.OrderedDict(), []
    for name, array in arrays.items():
        padded = np.concatenate([np.full(3, 7, np.float32), array.ravel()])
        storages.append(FloatStorage(str(len(storages)), padded))
        state[name] = Tensor(storages[-1], 3, array)
    return state, storages


def save_zip(path, arrays):
    state, storages = state_of(arrays)
    with zipfile.ZipFile(path, "w") as z:
        z.writestr("archive/data.pkl", dump(state, False))
        z.writestr("archive/version", "3\n")
        for s in storages:
            z.writestr(f"archive/data/{s.key}", s.values.tobytes())


def save_legacy(path, arrays):
    state, storages = state_of(arrays)
    with open(path, "wb") as f:
        for obj in (lpips_numpy.lpips_convert.LEGACY_MAGIC, 1001, {"protocol_version": 1001, "little_endian": True}):
            f.write(pickle.dumps(obj, 2))
        f.write(dump(state, True))
        f.write(pickle.dumps([s.key for s in storages], 2))
        for s in storages:
            f.write(struct.pack("<q", s.values.size) + s.values.tobytes())


def trunk_arrays(net, convs):
    arrays = collections.OrderedDict()
    for (index, *_), (weight, bias) in zip(lpips_numpy.lpips_convert.NETS[net], convs):
        arrays[f"features.{index}.weight"], arrays[f"features.{index}.bias"] = weight, bias
    arrays["classifier.6.bias"] = np.zeros(5, np.float32)
    return arrays


def lin_arrays(lins):
    return collections.OrderedDict((f"lin{i}.model.1.weight", l.reshape(1, -1, 1, 1)) for i, l in enumerate(lins))


def convert(*arguments):
    return subprocess.run([sys.executable, str(CONVERT), *map(str, arguments)], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True, check=False)


def picture(path):
    return cv2.imread(str(path))[..., ::-1] / 255.0


class Lpips(common.FolderTest):
    def evaluate(self, *options):
        (self.dir / "out").mkdir(exist_ok=True)
        renders = self.dir / "renders"  # one layer is enough
        shutil.copytree(FIXTURE / "renders" / "T_N", renders / "T_N", dirs_exist_ok=True)
        return common.run("evaluate", self.dir / "out", FIXTURE / "truth", "--output", renders, *options,
                          timeout=900)

    def test_against_numpy(self):
        weights = {net: lpips_numpy.made_up(net) for net in ("alex", "vgg")}
        for net, save in (("alex", save_zip), ("vgg", save_legacy)):
            save(self.dir / f"{net}.pth", trunk_arrays(net, weights[net][0]))
            (save_legacy if save is save_zip else save_zip)(self.dir / f"{net}_lin.pth", lin_arrays(weights[net][1]))
        self.assert_works(convert("-o", self.dir / "w", "--alexnet", self.dir / "alex.pth", "--alexnet-lin",
                                  self.dir / "alex_lin.pth", "--vgg", self.dir / "vgg.pth", "--vgg-lin", self.dir / "vgg_lin.pth"))
        run = self.assert_works(self.evaluate("--lpips-weights", self.dir / "w", "--json", self.dir / "j.json"))
        self.assertIn("LPIPS-A LPIPS-V", run.stdout)
        layer = json.loads((self.dir / "j.json").read_text())["methods"]["flashsplat"]["layers"]["T_N"]
        gain = np.array(layer["gain"])
        for view in ("TEST_01", "TEST_02"):
            a, b = (picture(FIXTURE / d / "T_N" / f"{view}.png") for d in ("truth", "renders"))
            fitted = np.clip(b ** (1 / 0.22) * gain, 0, 1) ** 0.22
            for net in ("alex", "vgg"):
                for key, estimate in ((f"lpips_{net}", b), (f"lpips_{net}_gain", fitted)):
                    expected = lpips_numpy.distance(net, weights[net], a, estimate)
                    self.assertGreater(expected, 1e-3)
                    self.assertAlmostEqual(layer["views"][view][key] / expected, 1, delta=2e-4)
        self.assertIn("lpips_vgg_paper", layer)
        # One network alone: only its column.
        self.assert_works(convert("-o", self.dir / "w", "--alexnet", self.dir / "alex.pth", "--alexnet-lin", self.dir / "alex_lin.pth"))
        run = self.evaluate("--lpips-weights", self.dir / "w", "--json", self.dir / "one.json")
        self.assertIn("LPIPS-A", run.stdout)
        self.assertNotIn("LPIPS-V", run.stdout)
        self.assertNotIn("lpips_vgg", (self.dir / "one.json").read_text())

    def test_without_weights(self):
        run = self.assert_works(self.evaluate())
        self.assertIn("tools/lpips_convert.py", run.stdout + run.stderr)
        self.assertNotIn("LPIPS-A", run.stdout)

    def test_bad_pth(self):
        lins = lin_arrays(lpips_numpy.made_up("alex")[1])
        save_legacy(self.dir / "lin.pth", lins)
        good = (self.dir / "lin.pth").read_bytes()
        evil = pickle.dumps(subprocess.Popen, 2)  # refers to a class of another module
        bad = {"empty": b"", "text": b"hello", "cut": good[:-5], "evil": evil, "zip": b"PK\3\4" + bytes(30)}
        nan = lin_arrays([l.copy() for l in lpips_numpy.made_up("alex")[1]])
        nan["lin3.model.1.weight"][0, 5] = np.nan
        for name, data in bad.items():
            (self.dir / name).write_bytes(data)
        save_zip(self.dir / "nan", nan)
        save_zip(self.dir / "other", {"lin0.model.1.weight": np.zeros((1, 3, 1, 1), np.float32)})
        save_zip(self.dir / "nothing", {})
        for name in [*bad, "nan", "other", "nothing", "missing"]:
            done = convert("-o", self.dir / "w", "--alexnet", self.dir / name, "--alexnet-lin", self.dir / name)
            self.assertEqual(done.returncode, 1, name)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
            self.assertIn(str(self.dir / name), done.stderr)
            self.assertFalse((self.dir / "w").exists())


common.main()
