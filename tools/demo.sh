#!/bin/sh
# `make demo`: a made capture through glass, the whole job on it with COLMAP in the loop as on anybody's photos, and the
# result measured against the truth. The first argument is the program.
set -eu

flashsplat=$1
scene=demo/scene
out=demo/out
mkdir -p demo

echo "== A capture through glass: photos, and the truth to compare with"
[ -f $scene/truth/cameras.json ] || "$flashsplat" synth -o $scene

echo "== From the photos to the separated scene"
resume=--resume # what was interrupted; a demo that an earlier version finished is made anew where that is needed
[ ! -f $out/done/train.json ] || resume=
"$flashsplat" run $scene/capture/raw -o $out --preset preview $resume

echo "== Measured against the truth, at the photos' own poses"
"$flashsplat" evaluate $out $scene/truth --views capture

view=$(ls $scene/truth/T_N | head -1)
echo
echo "Look at one photo's separation, and the truth beside it:"
for layer in T_N R; do
    echo "  $out/renders/$layer/$view    $scene/truth/$layer/$view"
done
