#!/bin/sh
# One drape in other triangles: uniform, one panel finer, and fine and long along its folds.
#
#   sh scenes/remesh/phi.sh out/phi                                      # from the root of the repository
#   sh scenes/remesh/phi.sh out/phi --set garment.edge_length=0.022     # a coarser drape: a minute, not ten
set -eu
out=$1
shift

[ -d "$out/drape" ] || muslin simulate scenes/remesh/long_dress.toml --out "$out/drape" "$@"

muslin remesh "$out/drape" --target-area 5e-4 --max-distortion 2.2 --out "$out/uniform.obj"
muslin remesh "$out/drape" --target-area 8e-4 --panel-area front=3e-4 --out "$out/front.obj"
muslin remesh "$out/drape" --target-area 5e-4 --refine-angle 0.3 --refine-compression 0.01 \
  --size-min 0.01 --size-max 0.1 --aspect-min 0.3 --out "$out/folds.obj"
