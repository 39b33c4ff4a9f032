#!/usr/bin/env python3
"""Makes the weight file that `flashsplat evaluate --lpips-weights FILE` reads; see docs/lpips.md.

usage: lpips_convert.py -o FILE [--alexnet TRUNK.pth --alexnet-lin LIN.pth] [--vgg TRUNK.pth --vgg-lin LIN.pth]

TRUNK.pth are torchvision's files, LIN.pth those of the LPIPS program (version 0.1). Python's own library is enough:
PyTorch is not needed, and nothing in the files is executed.
"""
import argparse
import array
import collections
import io
import math
import os
import pickle
import struct
import sys
import zipfile

MAGIC = b"FSLPIPS1"
# Per network: indices of the convolutions in torchvision's `features`, and (output, input channels, kernel size) of each.
NETS = {
    "alex": [(0, 64, 3, 11), (3, 192, 64, 5), (6, 384, 192, 3), (8, 256, 384, 3), (10, 256, 256, 3)],
    "vgg": [(0, 64, 3, 3), (2, 64, 64, 3), (5, 128, 64, 3), (7, 128, 128, 3), (10, 256, 128, 3), (12, 256, 256, 3),
            (14, 256, 256, 3), (17, 512, 256, 3), (19, 512, 512, 3), (21, 512, 512, 3), (24, 512, 512, 3),
            (26, 512, 512, 3), (28, 512, 512, 3)],
}
LINS = {"alex": [64, 192, 384, 256, 256], "vgg": [64, 128, 256, 512, 512]}
LEGACY_MAGIC = 0x1950A86A20F9469CFC6C
ITEM_SIZE = {"FloatStorage": 4, "DoubleStorage": 8, "HalfStorage": 2, "LongStorage": 8, "IntStorage": 4,
             "ShortStorage": 2, "ByteStorage": 1, "CharStorage": 1, "BoolStorage": 1}


class Bad(Exception):
    """A file that is not what it should be."""


class StorageType:
    def __init__(self, name):
        self.name = name


class Tensor:
    """Where a tensor lies: the values come once the storages are read."""

    def __init__(self, storage, offset, size, stride):
        self.storage, self.offset, self.size, self.stride = storage, offset, tuple(size), tuple(stride)

    def floats(self):
        kind, data = self.storage["kind"], self.storage["data"]
        if kind != "FloatStorage":
            raise Bad(f"values of {kind}, expected 32-bit floats")
        count, step = 1, 1
        for n, s in zip(reversed(self.size), reversed(self.stride)):
            if n != 1 and s != step:
                raise Bad("a tensor is not contiguous")
            step *= n
            count *= n
        raw = data[4 * self.offset:4 * (self.offset + count)]
        if len(raw) != 4 * count:
            raise Bad("a tensor reaches past the end of its values")
        values = array.array("f")
        values.frombytes(raw)
        if sys.byteorder != "little":
            values.byteswap()
        return values


def rebuild_tensor(storage, offset, size, stride, *_):
    return Tensor(storage, offset, size, stride)


def rebuild_parameter(data, *_):
    return data


class SafeUnpickler(pickle.Unpickler):
    """Knows the few names a state dict is made of, and nothing else."""

    storages = None  # key -> storage

    def find_class(self, module, name):
        if (module, name) == ("collections", "OrderedDict"):
            return collections.OrderedDict
        if module == "torch._utils" and name in ("_rebuild_tensor_v2", "_rebuild_tensor"):
            return rebuild_tensor
        if module == "torch._utils" and name == "_rebuild_parameter":
            return rebuild_parameter
        if module in ("torch", "torch.storage") and name.endswith("Storage"):
            return StorageType(name)
        raise Bad(f"refers to {module}.{name}: not a plain state dict")

    def persistent_load(self, pid):
        if not isinstance(pid, tuple) or len(pid) < 5 or pid[0] != "storage" or not isinstance(pid[1], StorageType):
            raise Bad("an unknown kind of storage")
        if len(pid) > 5 and pid[5] is not None:
            raise Bad("a storage is a view of another")
        return self.storages.setdefault(str(pid[2]), {"kind": pid[1].name, "n": int(pid[4]), "data": b""})


def unpickle(stream, storages):
    reader = SafeUnpickler(stream, encoding="latin1")
    reader.storages = storages
    return reader.load()


def load_zip(path):
    storages = {}
    with zipfile.ZipFile(path) as archive:
        pickles = [n for n in archive.namelist() if n.endswith("/data.pkl")]
        if len(pickles) != 1:
            raise Bad("no data.pkl in the archive")
        folder = pickles[0][:-len("data.pkl")]
        if folder + "byteorder" in archive.namelist() and archive.read(folder + "byteorder") != b"little":
            raise Bad("written on a big-endian machine")
        state = unpickle(io.BytesIO(archive.read(pickles[0])), storages)
        for key, storage in storages.items():
            storage["data"] = archive.read(f"{folder}data/{key}")
    return state


def load_legacy(path):
    storages = {}
    with open(path, "rb") as f:
        if unpickle(f, storages) != LEGACY_MAGIC:
            raise Bad("not a file of torch.save")
        unpickle(f, storages)  # protocol version
        system = unpickle(f, storages)
        if not system.get("little_endian", False):
            raise Bad("written on a big-endian machine")
        state = unpickle(f, storages)
        for key in unpickle(f, storages):
            storage = storages[str(key)]
            (n,) = struct.unpack("<q", f.read(8))
            size = ITEM_SIZE.get(storage["kind"])
            if n != storage["n"] or size is None:
                raise Bad(f"storage {key}: {n} values of {storage['kind']}, expected {storage['n']}")
            storage["data"] = f.read(n * size)
    return state


def load(path):
    """The state dict of a .pth file: name -> Tensor."""
    try:
        state = load_zip(path) if zipfile.is_zipfile(path) else load_legacy(path)
    except Bad:
        raise
    except Exception as error:  # pickle and zipfile raise all kinds on a damaged file
        raise Bad(f"not a readable .pth file ({type(error).__name__}: {error})") from error
    if isinstance(state, dict) and isinstance(state.get("state_dict"), dict):
        state = state["state_dict"]
    if not isinstance(state, dict):
        raise Bad("no state dict in it")
    return state


def tensor(state, names, count):
    found = next((state[n] for n in names if isinstance(state.get(n), Tensor)), None)
    if found is None:
        raise Bad(f"no tensor {names[0]}")
    values = found.floats()
    if len(values) != count:
        raise Bad(f"{names[0]}: {len(values)} values, expected {count}")
    if not all(map(math.isfinite, values)):
        raise Bad(f"{names[0]}: a value is not finite")
    if sys.byteorder != "little":
        values.byteswap()
    return values.tobytes()


def trunk_bytes(net, path):
    state, out = load(path), []
    for index, n_out, n_in, k in NETS[net]:
        name = f"features.{index}"
        weight = tensor(state, [f"{name}.weight"], n_out * n_in * k * k)
        out += [struct.pack("<4I", n_out, n_in, k, k), weight, tensor(state, [f"{name}.bias"], n_out)]
    return out


def lin_bytes(net, path):
    state, out = load(path), []
    for i, channels in enumerate(LINS[net]):
        names = [f"lin{i}.model.1.weight", f"lins.{i}.model.1.weight", f"lin{i}.model.0.weight"]
        out += [struct.pack("<I", channels), tensor(state, names, channels)]
    return out


def main():
    parser = argparse.ArgumentParser(description="Makes the weight file of flashsplat's LPIPS; see docs/lpips.md.")
    parser.add_argument("-o", "--output", required=True, metavar="FILE")
    for net in ("alexnet", "vgg"):
        parser.add_argument(f"--{net}", metavar="PTH", help="torchvision's file")
        parser.add_argument(f"--{net}-lin", metavar="PTH", help="LPIPS's file, version 0.1")
    a = parser.parse_args()
    given = [(n, t, l) for n, t, l in (("alex", a.alexnet, a.alexnet_lin), ("vgg", a.vgg, a.vgg_lin)) if t or l]
    if not given or not all(t and l for _, t, l in given):
        parser.error("give --alexnet and --alexnet-lin, or --vgg and --vgg-lin, or all four")
    out = [MAGIC, struct.pack("<I", len(given))]
    for net, trunk, lin in given:
        out.append(net.encode().ljust(8, b"\0"))
        for path, read in ((trunk, trunk_bytes), (lin, lin_bytes)):
            try:
                out += read(net, path)
            except (Bad, OSError) as error:
                sys.exit(f"{path}: {error}")
    part = f"{a.output}.part{os.getpid()}"
    with open(part, "wb") as f:
        f.writelines(out)
    os.replace(part, a.output)
    print(f"{a.output}: {', '.join(n for n, _, _ in given)}")


if __name__ == "__main__":
    main()
