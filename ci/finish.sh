#!/bin/sh
# Ends what serve.sh has started, which completes the recording, and draws the recording as a page that
# any browser opens: FOLDER/session.html.
#   ci/finish.sh FOLDER
set -eu
folder=$1
pid=$(cat "$folder/pid")
kill "$pid" 2>/dev/null || true
waited=0
while kill -0 "$pid" 2>/dev/null; do
    [ "$waited" -lt 100 ] || { echo "vimc4 serve does not end" >&2; exit 1; }
    sleep 0.1
    waited=$((waited + 1))
done
exec vimc4 replay "$folder/session.jsonl" --html "$folder/session.html"
