#!/bin/sh
# Ends what serve.sh has started, which completes the recording, and draws the recording as a page that
# any browser opens: FOLDER/session.html. Of several controllers each has its own, as session-2.html.
#   ci/finish.sh FOLDER
set -eu
unset CDPATH
serving=$(dirname "$0")/serving.sh
if [ ! -x "$serving" ]; then
    echo "serving.sh, which belongs beside $0, is missing" >&2
    exit 1
fi
case ${1:-} in
'' | -*)
    echo "usage: $0 FOLDER, the one of serve.sh; as in: $0 kept" >&2
    exit 2
    ;;
esac
folder=$(cd -- "$1" && pwd -P)
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
# Each of several controllers, and each part of a long recording, has a number.
numbered='^./session(-[0-9]+)?([.][0-9]+)?[.]jsonl$'
recordings=$(cd "$folder" && find . -maxdepth 1 | { grep -E "$numbered" || true; } | sort)
if [ -z "$recordings" ]; then
    echo "there is no recording in $1" >&2
    exit 1
fi
for recording in $recordings; do
    name=$folder/${recording#./}
    vimc4 replay "$name" --html "${name%.jsonl}.html" || code=$?
done
exit "$code"
