#!/usr/bin/env bash
# Holds the program for Windows, under Wine, against the one for this system:
#   ci/windows.sh VIMC4.EXE VIMC4
# Both write the same reports, recordings and pictures, to the byte. The one for Windows answers clients of this
# system over TCP and over a serial port, and is such a client itself. It needs Wine, socat and curl, and a MinGW
# compiler where Wine has no bcryptprimitives.dll. CONTROLLERS says how many of each model run at the same time.
set -euo pipefail
exe=$(realpath "$1")
here=$(realpath "$2")
root=$(realpath "$(dirname "$0")/..")
folder=$(mktemp -d)
export WINEPREFIX=$folder/wine WINEARCH=win64 WINEDEBUG=-all WINEDLLOVERRIDES="mscoree=;mshtml="
started=()
leave() {
    for pid in "${started[@]}"; do kill "$pid" 2>/dev/null || true; done
    wineserver -k 2>/dev/null || true
    rm -rf "$folder"
}
trap leave EXIT

count=0
failed=0
passed() { count=$((count + 1)); }
wrong() {
    failed=$((failed + 1))
    echo "FAILED  $*"
}
part() { printf '== %s (%ss)\n' "$1" "$SECONDS"; }

windows() { wine "$exe" "$@"; }

# await COMMAND…: until it succeeds, for 20 seconds.
await() {
    for _ in $(seq 200); do
        "$@" 2>/dev/null && return
        sleep 0.1
    done
    wrong "still not so after 20 s: $*"
    return 1
}

part "Wine"
wineboot -i >/dev/null 2>&1
wineserver -w
library=$WINEPREFIX/drive_c/windows/system32/bcryptprimitives.dll
if [ ! -e "$library" ]; then
    # Wine 8 lacks it, and every program of Rust asks it for random bytes.
    cat >"$folder/random.c" <<'C'
unsigned char __stdcall SystemFunction036(void *to, unsigned long length);
__declspec(dllexport) int __stdcall ProcessPrng(unsigned char *to, unsigned long long length)
{
    return SystemFunction036(to, (unsigned long)length);
}
C
    x86_64-w64-mingw32-gcc -shared -O -o "$library" "$folder/random.c" -ladvapi32
fi
windows --version
"$here" --version

part "reports"
# Each has a folder of its own, with the same files in it.
for side in here windows; do
    mkdir "$folder/$side"
    cp -r "$root/examples" "$folder/$side"
    mkdir "$folder/$side/crlf"
    for file in commands.txt program.txt plate.ncp look.txt machine.toml scenario.toml board.plt; do
        sed 's/$/\r/' "$root/examples/$file" >"$folder/$side/crlf/$file"
    done
done
# same ARGUMENTS…: both say the same and end with the same code; standard input goes to both.
same() {
    local input out_here out_windows
    input=$folder/input
    if [ -t 0 ]; then : >"$input"; else cat >"$input"; fi
    (cd "$folder/here" && "$here" "$@" <"$input" >../out.here 2>../err.here) && out_here=0 || out_here=$?
    (cd "$folder/windows" && windows "$@" <"$input" >../out.windows 2>../err.windows) && out_windows=0 || out_windows=$?
    if [ "$out_here" = "$out_windows" ] && cmp -s "$folder/out.here" "$folder/out.windows" &&
        cmp -s "$folder/err.here" "$folder/err.windows"; then
        passed
    else
        wrong "$* (exit code $out_windows, here $out_here)"
        diff "$folder/out.here" "$folder/out.windows" | head -n 10 || true
        diff "$folder/err.here" "$folder/err.windows" | head -n 10 || true
    fi
}
{
    same run examples/commands.txt --machine mill --plot path.svg --vcd path.vcd --fst path.fst --csv path.csv
    same run examples/commands.txt --machine mill --plot path.png --as gcode path.nc --as dxf path.dxf
    same run examples/commands.txt --machine mill --json
    same run examples/commands.txt --machine mill --record run.jsonl --coverage coverage.json
    same run examples/commands.txt --machine mill --scenario examples/scenario.toml
    same run examples/commands.txt --model examples/model.toml --machine examples/machine.toml
    same run examples/program.txt
    same run examples/board.plt --model smcu --machine board-plotter
    same run crlf/commands.txt --machine mill
    same run crlf/program.txt
    same run crlf/board.plt --model smcu --machine board-plotter
    same run crlf/commands.txt --machine crlf/machine.toml --scenario crlf/scenario.toml
    same ncp check examples/plate.ncp --machine mill
    same ncp run examples/plate.ncp --machine mill
    same ncp run examples/plate.ncp --machine mill --json
    same ncp compile examples/plate.ncp --machine mill -o plate.field
    same ncp check crlf/plate.ncp --machine mill
    same ncp run crlf/plate.ncp --machine mill
    same replay examples/limit.jsonl
    same replay examples/overlooked.jsonl --html recording.html
    same replay examples/limit.jsonl --quirk stop_reply=F0
    same diff examples/limit.jsonl examples/overlooked.jsonl
    same coverage coverage.json
    same sweep examples/limit.jsonl --out swept --shard 1/64
    same sweep examples/limit.jsonl --out swept --shard 1/64 --resume
    same console examples/commands.txt --machine mill --script examples/look.txt
    same console examples/commands.txt --machine mill --script crlf/look.txt
    same circle --radius 200 --from 135 --to 225 --ccw --speed 1500
    same models
    same machines
    same machines show mill
    same conform --list --allow moves --envelope 5000,5000,5000
} </dev/null
for model in $("$here" models | cut -d ' ' -f 1); do same models show "$model" </dev/null; done
printf 'step\nstep\nback\nposition\nwhy\n' | same console examples/commands.txt --machine mill
printf 'step\r\nnonsense\r\n' | same console examples/commands.txt --machine mill
# What was written is the same, too; the file for GTKWave names the folder.
find "$folder/here" -name '*.vimc4-new' -delete
# A recording says when it was made, and one of the two was made later.
sed -i 's/"began":[0-9]*/"began":0/' "$folder"/{here,windows}/run.jsonl
if diff -rq --exclude='*.gtkw' "$folder/here" "$folder/windows"; then passed; else wrong "the files differ"; fi
# A folder has either sign behind it.
(
    cd "$folder/windows"
    windows run 'examples\commands.txt' --machine mill >../out.windows
    cd ../here
    "$here" run examples/commands.txt --machine mill >../out.here
)
if cmp -s "$folder/out.here" <(sed 's|\\|/|g' "$folder/out.windows"); then passed; else wrong "examples\\commands.txt"; fi

part "what Windows has not"
# told WORDS ARGUMENTS…: is refused as wrong usage, with these words and without those for Linux.
told() {
    local words=$1 code=0
    shift
    windows "$@" </dev/null >"$folder/told" 2>&1 || code=$?
    if [ "$code" = 2 ] && grep -q "$words" "$folder/told" && ! grep -q dialout "$folder/told"; then
        passed
    else
        wrong "$* (exit code $code)"
        cat "$folder/told"
    fi
}
told "use TCP or a serial port" serve --tcp none --pty
told "use TCP or a serial port" serve --tcp none --replace
told "use TCP or a serial port" console --tcp none --replace
told "lists the ports" serve --tcp none --serial COM99

part "TCP"
# serve NAME OPTIONS…: starts the program for Windows, which says in NAME.json where it is.
serve() {
    local name=$1
    shift
    mkfifo "$folder/$name.orders"
    (cd "$folder/windows" && exec wine "$exe" serve --json --until-stdin-closes "$@") \
        <"$folder/$name.orders" >"$folder/$name.json" 2>"$folder/$name.err" &
    started+=($!)
    # As long as it is open there is no end of the input.
    # shellcheck disable=SC2034
    exec {orders}>"$folder/$name.orders"
    await grep -q '"ready":true' "$folder/$name.json"
}
# address NAME NUMBER: where its controller of that number listens.
address() { grep -o '"tcp":"[^"]*"' "$folder/$1.json" | sed -n "$2s/.*:\"\(.*\)\"/\1/p"; }
# All sessions that a port can show, of all models, in true time. Several controllers of each model share them, as
# many as the computer can serve without answers being late.
each=${CONTROLLERS:-2}
models=$("$here" models | cut -d ' ' -f 1)
all=(--allow "moves,reference,outputs,flash" --envelope "100000,100000,100000,100000" --yes --tolerance 3s)
players=()
for model in $models; do
    serve "$model" --model "$model" --tcp 127.0.0.1:0 --count "$each" --flash "$model.flash"
    "$here" conform --list --model "$model" "${all[@]}" | sed -n 's/^\([a-z][^ ]*\).*/\1/p' >"$folder/$model.sessions"
    for number in $(seq "$each"); do
        mapfile -t sessions < <(sed -n "$number~${each}p" "$folder/$model.sessions")
        [ "${#sessions[@]}" -gt 0 ] || continue
        "$here" conform "$(address "$model" "$number")" --model "$model" "${all[@]}" "${sessions[@]}" \
            >"$folder/$model.$number.said" 2>&1 &
        players+=("$!:$model.$number")
    done
done
for player in "${players[@]}"; do
    name=${player#*:}
    if wait "${player%%:*}" && grep -q ' 0 failed' "$folder/$name.said"; then
        passed
    else
        wrong "conform: $name"
        tail -n 20 "$folder/$name.said"
    fi
done
for model in $models; do
    # The name of one may be the beginning of another one's, which is then played twice.
    played=$(awk '/^[0-9]+ passed/ { sum += $1 } END { print sum + 0 }' "$folder/$model".*.said)
    wanted=$(wc -l <"$folder/$model.sessions")
    echo "$model: $wanted sessions"
    if [ "$played" -ge "$wanted" ]; then passed; else wrong "$model: only $played passed"; fi
done

part "serial port"
# Windows is the client: the controller is on a pseudo-terminal of this system.
serving() { exec "$here" serve --pty "$folder/near" --tcp none --json --until-stdin-closes; }
mkfifo "$folder/near.orders"
serving <"$folder/near.orders" >"$folder/near.json" 2>/dev/null &
started+=($!)
# shellcheck disable=SC2034
exec {orders}>"$folder/near.orders"
await grep -q '"ready":true' "$folder/near.json"
ln -s "$folder/near" "$WINEPREFIX/dosdevices/com50"
if windows doctor COM50 >"$folder/doctor" 2>&1; then passed; else
    wrong "doctor COM50"
    cat "$folder/doctor"
fi
if windows conform COM50 line/ errors/ --tolerance 3s >"$folder/client" 2>&1; then passed; else
    wrong "conform COM50"
    tail -n 20 "$folder/client"
fi
# Windows has the controller: a pair of pseudo-terminals is the cable.
socat "pty,rawer,link=$folder/this" "pty,rawer,link=$folder/that" &
started+=($!)
await test -e "$folder/that"
ln -s "$folder/this" "$WINEPREFIX/dosdevices/com51"
serve cable --serial COM51 --tcp none
if "$here" conform "$folder/that" line/ errors/ --tolerance 3s >"$folder/client" 2>&1; then passed; else
    wrong "conform on the cable"
    tail -n 20 "$folder/client"
fi

part "HTTP"
serve web --web --tcp none
url=$(sed -n 's/.*"http":"\([^"]*\)".*/\1/p' "$folder/web.json")
if curl -fsS "$url" | grep -q '<html'; then passed; else wrong "the panel"; fi
if "$here" ctl --url "$url" press stop >/dev/null; then passed; else wrong "ctl to Windows"; fi
if windows ctl --url "$url" position >/dev/null; then passed; else wrong "ctl from Windows"; fi

part "done: $count as they should be, $failed not"
[ "$failed" = 0 ]
