#!/bin/sh
# Prints the number of the process that serve.sh has left serving into a folder, or fails. The number in
# FOLDER/pid alone may long be that of another process.
#   ci/serving.sh FOLDER
set -eu
unset CDPATH
folder=$(cd -- "$1" && pwd -P)
pid=$(cat "$folder/pid" 2>/dev/null)
line=$({ tr '\0' ' ' <"/proc/$pid/cmdline" || ps -o args= -p "$pid"; } 2>/dev/null)
case $line in
    *" serve "*" $folder/session.jsonl "*) echo "$pid" ;;
    *) exit 1 ;;
esac
