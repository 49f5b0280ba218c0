#!/bin/sh
# Starts `vimc4 serve` for the steps that follow, and returns when it is ready.
#   ci/serve.sh FOLDER OPTIONS…
# FOLDER gets what a failure is explained with: session.jsonl (the recording), conversation.log, and what
# serve said (ready.json, errors.log), in place of what an earlier run has left. finish.sh ends it.
set -eu
given=$1
shift
mkdir -p "$given"
folder=$(cd "$given" && pwd -P)
if "$(dirname "$0")/serving.sh" "$folder" >/dev/null; then
    echo "the controller of an earlier run still serves into $given; end it by finish.sh $given" >&2
    exit 1
fi
(cd "$folder" && rm -f pid ready.json errors.log conversation*.log session*.jsonl session*.html)
nohup vimc4 serve --json --record "$folder/session.jsonl" --log "$folder/conversation.log" "$@" \
    </dev/null >"$folder/ready.json" 2>"$folder/errors.log" &
pid=$!
echo "$pid" >"$folder/pid"
waited=0
until [ -s "$folder/ready.json" ]; do
    if ! kill -0 "$pid" 2>/dev/null || [ "$waited" -ge 600 ]; then
        kill "$pid" 2>/dev/null || true
        rm -f "$folder/pid"
        echo "vimc4 serve did not become ready:" >&2
        cat "$folder/errors.log" >&2
        exit 1
    fi
    sleep 0.1
    waited=$((waited + 1))
done
cat "$folder/ready.json"
