#!/bin/sh
# Starts `vimc4 serve` for the steps that follow, and returns when it is ready.
#   ci/serve.sh FOLDER OPTIONS…
# FOLDER gets what a failure is explained with: session.jsonl (the recording), conversation.log, and what
# serve said (ready.json, errors.log). `kill $(cat FOLDER/pid)` ends it and completes the recording.
set -eu
folder=$1
shift
mkdir -p "$folder"
nohup vimc4 serve --json --record "$folder/session.jsonl" --log "$folder/conversation.log" "$@" \
    </dev/null >"$folder/ready.json" 2>"$folder/errors.log" &
pid=$!
echo "$pid" >"$folder/pid"
waited=0
until [ -s "$folder/ready.json" ]; do
    if ! kill -0 "$pid" 2>/dev/null || [ "$waited" -ge 600 ]; then
        echo "vimc4 serve did not become ready:" >&2
        cat "$folder/errors.log" >&2
        exit 1
    fi
    sleep 0.1
    waited=$((waited + 1))
done
cat "$folder/ready.json"
