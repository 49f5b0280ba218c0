#!/bin/sh
# Starts `vimc4 serve` for the steps that follow, and returns when it is ready.
#   ci/serve.sh FOLDER OPTIONS…
# FOLDER gets what a failure is explained with: session.jsonl (the recording), conversation.log, and what
# serve said (ready.json, errors.log), in place of what an earlier run has left. finish.sh ends it.
set -eu
unset CDPATH
here=$(dirname "$0")
if [ ! -x "$here/serving.sh" ]; then
    echo "serving.sh, which belongs beside $0, is missing" >&2
    exit 1
fi
case ${1:-} in
'' | -*)
    echo "usage: $0 FOLDER [OPTIONS OF vimc4 serve]; as in: $0 kept --model imc4" >&2
    exit 2
    ;;
esac
given=$1
shift
mkdir -p -- "$given"
folder=$(cd -- "$given" && pwd -P)
if "$here/serving.sh" "$folder" >/dev/null; then
    echo "the controller of an earlier run still serves into $given; finish.sh with that folder ends it" >&2
    exit 1
fi
(
    cd "$folder"
    rm -f pid ready.json errors.log conversation.log
    # Each of several controllers, and each part of a long recording, has a number.
    find . -maxdepth 1 | grep -E '^./session(-[0-9]+)?([.][0-9]+)?[.](jsonl|html)$' | xargs rm -f
)
nohup vimc4 serve --json --record "$folder/session.jsonl" --log "$folder/conversation.log" "$@" \
    </dev/null >"$folder/ready.json" 2>"$folder/errors.log" &
pid=$!
# Who ends this script before it is ready has no controller left.
trap 'kill "$pid" 2>/dev/null' EXIT
trap 'exit 1' HUP INT TERM
waited=0
until [ -s "$folder/ready.json" ] && kill -0 "$pid" 2>/dev/null; do
    if ! kill -0 "$pid" 2>/dev/null || [ "$waited" -ge 600 ]; then
        echo "vimc4 serve did not become ready:" >&2
        cat "$folder/errors.log" >&2
        exit 1
    fi
    sleep 0.1
    waited=$((waited + 1))
done
trap - EXIT
echo "$pid" >"$folder/pid"
cat "$folder/ready.json"
