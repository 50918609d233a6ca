#!/usr/bin/env bash
# Makes three.min.js, what the viewer needs of three.js, and three.LICENSE.txt: ./build.sh (needs node and npm).
set -euo pipefail
three=0.187.0
esbuild=0.28.2

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm install --silent --no-audit --no-fund --ignore-scripts "three@$three" "esbuild@$esbuild"
cat > entry.js <<'ENTRY'
export {
  BufferAttribute, BufferGeometry, CircleGeometry, Color, DataTexture, DirectionalLight, DoubleSide, Group,
  HemisphereLight, LinearFilter, LineBasicMaterial, LineSegments, Mesh, MeshLambertMaterial, PCFShadowMap,
  PerspectiveCamera, Raycaster, REVISION, Scene, ShadowMaterial, SRGBColorSpace, Vector2, Vector3, WebGLRenderer,
} from "three";
ENTRY
node_modules/.bin/esbuild entry.js --bundle --minify --format=iife --global-name=THREE --target=es2020 \
  --charset=ascii --legal-comments=none --outfile="$here/three.min.js"
cp node_modules/three/LICENSE "$here/three.LICENSE.txt"
