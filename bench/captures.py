"""The captures that `flashsplat synth` makes for quality.py and compare.py."""

LARGE = "--width 1200 --height 800"
SYNTH = {  # name: seed (it chooses the layout too), difficulties, folder of the photos; options of `synth`
    "synth-1": (1, "", "raw"),
    "synth-2": (2, "", "raw"),
    "synth-3": (3, "", "raw"),
    "synth-4": (4, "", "raw"),
    "synth-20": (20, "", "raw"),
    "weak-flash": (5, "weak-flash", "raw"),
    "strong-reflection": (6, "strong-reflection", "raw"),
    "few-photos": (7, "few-photos", "raw"),
    "low-texture": (8, "low-texture", "raw"),
    "depth-overlap": (9, "depth-overlap", "raw"),
    "frame": (10, "frame", "raw"),
    "flash-return": (11, "flash-return", "raw"),
    "bright-near-room": (12, "bright-near-room", "raw"),
    "pose-noise": (13, "pose-noise", "raw"),
    "jpeg": (14, "", "jpeg"),
    "dark": (16, "dark", "raw"),
    "wide-path": (18, "wide-path", "raw"),
    "collapse": (19, "bright-near-room,wide-path,few-photos", "raw"),
    "full-1": (41, "", "raw", LARGE),  # full-*: one of each layout, measured where --only names them
    "full-2": (42, "", "raw", LARGE),
    "full-3": (43, "", "raw", LARGE),
    "full-4": (44, "dark", "raw", LARGE),
    "full-5": (45, "bright-near-room,low-texture", "raw", LARGE),
}
# Faults of real captures: the same capture without and with each of them alone and all together, where --only
# names them. Of JPEG files only those that change them.
FIELD_SEED, FIELD_SIZE = 31, "--width 600 --height 400 --photos 24"
FAULTS = ("flash-jitter", "drift", "shutter", "vignetting", "white-balance", "under", "distortion", "shake", "defocus",
          "photographer", "pedestrian", "dirt", "double-glazing", "tint", "all")
FIELD = {"field-none": ("", "raw"), **{f"field-{f}": (f, "raw") for f in FAULTS},
         "field-none-jpeg": ("", "jpeg"), "field-jpeg": ("jpeg", "jpeg"), "field-jpeg-white-balance": ("jpeg,white-balance", "jpeg"),
         "field-jpeg-vignetting": ("jpeg,vignetting", "jpeg"), "field-all-jpeg": ("all", "jpeg")}
SYNTH.update({name: (FIELD_SEED, "", photos, FIELD_SIZE + (f" --field {faults}" if faults else ""))
              for name, (faults, photos) in FIELD.items()})
# One looks at the pane at a right angle: each layout, the same with who takes the photos and the flash in the pane.
STRAIGHT = {f"straight-{seed}{word}": (seed, "straight-on", "raw", FIELD_SIZE + faults) for seed in (31, 32, 33, 34, 36, 37, 42, 47)
            for word, faults in (("", ""), ("-mirrored", " --field photographer,mirrored-flash"))}
SYNTH.update(STRAIGHT)
# As little is mirrored as window glass mirrors of a dim room; each layout.
SYNTH.update({f"faint-{seed}": (seed, "", "raw", FIELD_SIZE + " --reflection 0.12") for seed in (701, 33, 711, 713, 714, 716, 731, 702, 712, 804, 806, 807, 808, 811, 812, 813)})
SYNTH.update({f"faint-{seed}": (seed, "frame", "raw", FIELD_SIZE + " --reflection 0.12") for seed in (801, 802, 803)})
SYNTH.update({f"faint-{seed}": (seed, "", "raw", FIELD_SIZE + f" --reflection {share}") for seed, share in ((816, 0.04), (841, 0.06), (842, 0.08), (854, 0.25))})
# Lamps and a screen behind the pane; each layout.
SYNTH.update({f"lit-{seed}": (seed, "lit", "raw", FIELD_SIZE) for seed in (760, 761, 762, 763, 764)})
ONLY_NAMED = ("full-*", "field-*", "straight-*", "faint-*", "lit-*")
