#!/bin/sh
# Repeats a run of this archive with LIGGGHTS alone, and compares what the engine writes with what it wrote then:
#
#     sh repeat.sh runs/NAME-HASH FOLDER
#
# Needs: apt-get install liggghts g++ libliggghts-dev libopenmpi-dev    (mpirun: openmpi-bin)
# Exit status: 0 the dumps are the same, 1 a dump differs, 2 the run cannot be repeated.
set -eu

fail() {
    echo "repeat.sh: $1" >&2
    exit 2
}

[ $# -eq 2 ] || fail "expected the folder of a run and the name of a new folder"
run=$1
[ -d "$run" ] || fail "$run: no such folder"
[ ! -e "$2" ] || fail "$2 exists already"
model=$(cd "$(dirname "$0")" && pwd)/contact_model

# Long runs have several segments; each but the first one starts from the restart file of the one before. Runs that
# were made together have the deck of all of them. A deck that was run by hand is in the folder itself.
if [ -f "$run/shared_deck/walker.lig" ]; then
    folders=shared_deck
elif [ -f "$run/segments/0000/walker.lig" ]; then
    folders=$(cd "$run" && echo segments/[0-9][0-9][0-9][0-9])
elif [ -f "$run/walker.lig" ]; then
    folders=.
else
    fail "$run: no deck (walker.lig) in it"
fi

for folder in $folders; do
    [ -f "$run/$folder/bridges.txt" ] || fail "$run/$folder: its tables of forces (bridges.txt) were left out"
done
[ -f "$model/bridge.so" ] || sh "$model/build.sh"
mkdir -p "$2"
new=$(cd "$2" && pwd)
status=0
before=
for folder in $folders; do
    mkdir -p "$new/$folder"
    for file in "$run/$folder"/*; do
        case ${file##*/} in
            *.lig | *.txt | *.awk | *.py) cp "$file" "$new/$folder" ;;
        esac
    done
    rm -f "$new/$folder/bridges.pairs.txt" "$new/$folder/bridges.walls.txt"
    [ -z "$before" ] || cp "$before/state.restart" "$new/$folder/previous.restart"
    ranks=$(sed -n 's/^exec mpirun -n \([0-9][0-9]*\) .*/\1/p' "$run/$folder/run.sh")
    parallel=${ranks:+mpirun --allow-run-as-root --oversubscribe -n $ranks}
    (
        cd "$new/$folder"
        $parallel env LC_ALL=C LD_PRELOAD="$model/bridge.so" liggghts -log none -in walker.lig > engine.log
    ) || fail "the engine failed; see $new/$folder/engine.log"
    for dump in beads.bin bridges.pairs.txt bridges.walls.txt; do
        if [ ! -f "$run/$folder/$dump" ]; then
            echo "written    $folder/$dump (nothing to compare with)"
        elif cmp -s "$run/$folder/$dump" "$new/$folder/$dump"; then
            echo "the same   $folder/$dump"
        else
            echo "different  $folder/$dump"
            status=1
        fi
    done
    before=$new/$folder
done
exit $status
