#!/usr/bin/env bash
# Makes the scripts and licences of dusttaichi/report/assets anew: the page's code bundled with
# three.js, and plotly.js. Its style sheet is written by hand.
# Needs node and npm; who only uses the program needs neither.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd -P)
assets=$here/../assets
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp "$here"/*.js "$here"/package.json "$work"
cd "$work"
npm install --no-audit --no-fund --silent
node_modules/.bin/esbuild page.js --bundle --minify --format=iife --target=es2022 \
    --legal-comments=none --outfile="$assets/report.js"
cp node_modules/plotly.js-basic-dist-min/plotly-basic.min.js "$assets/plotly.js"
version() { node -p "require('./node_modules/$1/package.json').version"; }
{
    echo "Bundled in this folder, each under its own licence."
    echo
    echo "== three.js $(version three), in report.js (https://threejs.org)"
    cat node_modules/three/LICENSE
    echo
    echo "== plotly.js $(version plotly.js-basic-dist-min), plotly.js (https://plotly.com/javascript)"
    cat node_modules/plotly.js-basic-dist-min/LICENSE
} > "$assets/LICENSES.txt"
ls -l "$assets"
