#!/bin/sh
# Twenty topologies of one design, all of one mean triangle area, all fitted to one drape.
#
#   sh scenes/remesh/topologies.sh out/topologies 20                     # from the root of the repository
#   sh scenes/remesh/topologies.sh out/topologies 20 --set garment.edge_length=0.022
set -eu
out=$1
count=$2
shift 2

[ -d "$out/drape" ] || muslin simulate scenes/remesh/long_dress.toml --out "$out/drape" "$@"

muslin remesh "$out/drape" --target-area 5e-4 --topologies "$count" --binding --out "$out/long_dress.obj"
