#!/bin/sh
# Ends what serve.sh has started, which completes the recording, and draws the recording as a page that
# any browser opens: FOLDER/session.html. Of several controllers each has its own, as session-2.html.
#   ci/finish.sh FOLDER
set -eu
folder=$(cd "$1" && pwd -P)
serving=$(dirname "$0")/serving.sh
if pid=$("$serving" "$folder"); then
    kill "$pid" 2>/dev/null || true
    waited=0
    while "$serving" "$folder" >/dev/null; do
        [ "$waited" -lt 100 ] || { echo "vimc4 serve does not end" >&2; exit 1; }
        sleep 0.1
        waited=$((waited + 1))
    done
else
    echo "nothing serves into $1 any more; what vimc4 serve said:" >&2
    cat "$folder/errors.log" >&2 || true
fi
rm -f "$folder/pid"
code=0
for recording in "$folder"/session*.jsonl; do
    if [ ! -e "$recording" ]; then
        echo "there is no recording in $1" >&2
        exit 1
    fi
    vimc4 replay "$recording" --html "${recording%.jsonl}.html" || code=$?
done
exit "$code"
