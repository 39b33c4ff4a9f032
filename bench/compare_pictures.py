"""The pictures that compare.html shows: which file is of a view, and those of other programs in our own encoding."""
import glob

try:
    import cv2, numpy
except ImportError:
    cv2 = None

SHOWN = (".png", ".jpg", ".jpeg")  # by browsers
EXACT = (*SHOWN, ".tif", ".tiff")  # as `evaluate` looks for them
READ = (*EXACT, ".jpe", ".jfif", ".heic", ".heif", ".hif", ".avif", ".heics", ".avifs")


def begins(stem, view):
    return stem.startswith(view) and stem[len(view):len(view) + 1] in ("", "-", "_", ".", " ")


def find_picture(folder, view, views):
    """The picture of a view: its name, or that and more where only one file has it and no longer name of `views` begins
    it, as `evaluate` takes it."""
    exact = next((p for e in EXACT if (p := folder / f"{view}{e}").is_file()), None)
    longer = [v for v in views if len(v) > len(view)]
    more = [p for p in sorted(folder.glob(f"{glob.escape(view)}*")) if p.suffix.lower() in READ and begins(p.stem, view)
            and not any(begins(p.stem, v) for v in longer)]
    exact = exact or next((p for p in more if p.stem == view), None)
    return exact or (more[0] if len(more) == 1 else None)


def recode(path, encoding):
    """The bytes of a PNG of linear^0.22; None where nothing here reads the picture."""
    if cv2 is None:
        return None
    try:
        image = cv2.imread(str(path), cv2.IMREAD_COLOR | cv2.IMREAD_ANYDEPTH | cv2.IMREAD_IGNORE_ORIENTATION)
    except cv2.error:
        image = None
    if image is None:
        return None
    most = numpy.iinfo(image.dtype).max if image.dtype.kind == "u" else 1
    v = numpy.clip(numpy.nan_to_num(image.astype(numpy.float64)) / most, 0, 1)
    if encoding == "srgb":
        v = numpy.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)
    v = v if encoding == "gamma" else v ** 0.22
    return cv2.imencode(".png", numpy.rint(255 * v).astype(numpy.uint8))[1].tobytes()


def to_show(path, encoding):
    """A picture as the page shows it: suffix (None: it cannot be shown), bytes, and what is to be said of that."""
    fine = path.suffix.lower() in SHOWN
    if fine and encoding == "gamma":
        return path.suffix, path.read_bytes(), ""
    content = recode(path, encoding)
    if content is not None:
        return ".png", content, ""
    if fine:
        note = f"pictures as the files hold them ({encoding}), not in our encoding, for want of python3-opencv"
        return path.suffix, path.read_bytes(), note
    note = f"pictures left out: a page shows no {path.suffix.lower()}"
    return None, b"", note + ("" if cv2 else ", which python3-opencv may read")
