#!/bin/sh
# The same trials by processes, by a Ray cluster of two nodes on this machine, and by one of
# whose nodes is killed in mid-run: is the file the same, and how fast is each? Processes and
# cluster take turns, three times; their medians count.
# Usage: bench/trials_cluster.sh PYTHON TRIALS, with miburi[cluster] installed for PYTHON; with
# fewer than a hundred TRIALS a run is over before a node can be killed.
set -eu
python=$1 trials=$2 dir=$(mktemp -d)
export RAY_DEDUP_LOGS=0 PYTHONUNBUFFERED=1
ray="$python -m ray.scripts.scripts"
run() { name=$1; shift; "$python" -m miburi trials --free "$trials" --blocked "$trials" --seed 11 --json --out "$dir/$name.parquet" "$@" > "$dir/$name.json" 2> "$dir/$name.err" || tail -5 "$dir/$name.err"; }
say() { "$python" -c "import json, statistics, sys; print(sys.argv[1], statistics.median(json.load(open(path))['trials_per_second'] for path in sys.argv[2:]), 'trials/s')" "$@"; }
$ray start --head --node-ip-address 127.0.0.1 --port 6391 --num-cpus 1 --include-dashboard false --disable-usage-stats --object-store-memory 100000000 --block > "$dir/head.log" 2>&1 & head=$! node=
trap 'kill $node $head 2> /dev/null || true' EXIT
sleep 25
$ray start --address 127.0.0.1:6391 --node-ip-address 127.0.0.1 --num-cpus 1 --object-store-memory 100000000 --block > "$dir/node.log" 2>&1 & node=$!
sleep 25
for turn in 1 2 3; do
  run processes$turn --workers 2
  run cluster$turn --ray 127.0.0.1:6391
done
say processes "$dir"/processes?.json
say cluster "$dir"/cluster?.json
run killed --ray 127.0.0.1:6391 & killed=$!
while ! [ -s "$dir/.killed.parquet.journal" ] || [ "$(wc -l < "$dir/.killed.parquet.journal")" -lt 3 ]; do sleep 0.2; done
kill $node
echo "a node was killed after $(($(wc -l < "$dir/.killed.parquet.journal") - 1)) chunks"
wait $killed
say killed "$dir/killed.json"
sha256sum "$dir"/*.parquet | sed "s|$dir/||"
