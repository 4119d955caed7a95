#!/usr/bin/env bash
# Both commands on other machines: in bare roots made by debootstrap, from a clone of what is committed here.
#   bash tests/elsewhere.sh [--with TEXT] SETTING...    TEXT: options of tests/run.sh, such as --quick
#   bash tests/elsewhere.sh --table                     results so far, into CONTRIBUTING.md
# Settings: debian12 debian13 python314 lowest latest bits256 bits512 no-fma load8 user umlaut home-read-only. All but debian12,
# lowest (Python 3.11) and python314 (Debian 14, testing) are on Debian 13. Several at once are joined: debian12+lowest+umlaut.
# container: in place of both commands the steps of packaging/Dockerfile, and a command of its image on two ranks.
# Roots are kept in ELSEWHERE (/var/tmp/hpcclear-elsewhere), results in results/elsewhere. The system underneath is this
# machine's; so are PIP_* and *SSL*, *CERT* variables and certificates.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
checkout=$PWD
place=${ELSEWHERE:-/var/tmp/hpcclear-elsewhere}
results=$checkout/results/elsewhere
mirror=${DEBIAN_MIRROR:-http://deb.debian.org/debian}

refuse() {
    echo "elsewhere: $1" >&2
    exit 2
}

# Rows of settings that were not run here stay as they are; each names the commit that it was found with.
table() {
    local row
    mkdir -p "$results"
    sed -n '/^<!-- elsewhere: begin/,/^<!-- elsewhere: end/{/^| [a-z0-9+-]* |/p}' CONTRIBUTING.md |
        sed -e '/^| setting |/d' -e '/^| --- |/d' | while IFS= read -r row; do
        [ -f "$results/$(cut -d' ' -f2 <<<"$row").row" ] || echo "$row"
    done >"$results/kept"
    {
        echo "| setting | Python | processor | first command | second command | commit |"
        echo "| --- | --- | --- | --- | --- | --- |"
        cat "$results"/kept "$results"/*.row 2>/dev/null | sort || true
    } >"$results/table.md"
    sed -i -e "/^<!-- elsewhere: begin/,/^<!-- elsewhere: end/{/^<!--/!d}" \
        -e "/^<!-- elsewhere: begin/r $results/table.md" CONTRIBUTING.md
    cat "$results/table.md"
}

# A root with Python and what a user of it would have: root_of RELEASE
root_of() {
    local root=$place/$1 python=python3 script=/usr/share/debootstrap/scripts/$1
    [ "$1" != forky ] || python=python3.14
    [ -e "$script" ] || script=${script%/*}/sid # a release that is newer than debootstrap
    if [ ! -f "$root/.whole" ]; then
        rm -rf --one-file-system "$root"
        mkdir -p "$place"
        debootstrap --variant=minbase --include="$python,$python-venv,git,ca-certificates,util-linux" \
            "$1" "$root" "$mirror" "$script" >"$place/$1.log" 2>&1 || refuse "debootstrap $1 failed: $place/$1.log"
        [ "$python" = python3 ] || ln -sf "/usr/bin/$python" "$root/usr/local/bin/python3"
        touch "$root/.whole"
    fi
    # The network as this machine sees it, also after that has changed.
    cp -L /etc/resolv.conf /etc/hosts "$root/etc/"
    mkdir -p "$root/etc/ssl/certs"
    cp -L /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/"
}

# Features of the host, less those that a setting takes away, as NUMBA_CPU_FEATURES: features PATTERN
features() {
    "${PYTHON:-python3}" - "$1" <<'PYTHON'
import re, sys
names = {"pni": "sse3", "sse4_1": "sse4.1", "sse4_2": "sse4.2", "abm": "lzcnt", "pclmulqdq": "pclmul"}
kept = "sse sse2 sse3 ssse3 sse4.1 sse4.2 popcnt avx avx2 fma f16c bmi1 bmi2 lzcnt avx512f avx512dq avx512bw avx512vl avx512cd"
with open("/proc/cpuinfo") as file:
    flags = next(line.split(":")[1].split() for line in file if line.startswith("flags"))
have = {names.get(flag, flag) for flag in flags}
out = []
for name in kept.split():
    on = name in have and not re.match(sys.argv[1], name)
    out.append(("+" if on else "-") + {"bmi1": "bmi"}.get(name, name))
print(",".join(out))
PYTHON
}

run_setting() {
    local setting=$1 release=trixie user=root home=/root above=/opt inner="" option="" load=0 settings=() words="$run_words" part
    local commands=()
    for part in ${setting//+/ }; do
        case $part in
        debian13) ;;
        latest) option=--latest ;;
        debian12) release=bookworm ;;
        python314) release=forky ;;
        lowest) release=bookworm option=--lowest ;;
        bits256) settings=("NUMBA_CPU_NAME=generic" "NUMBA_CPU_FEATURES=$(features 'avx512')") ;;
        bits512)
            grep -qw avx512f /proc/cpuinfo || {
                echo "| $setting | - | - | not on this processor | not on this processor | - |" >"$results/$setting.row"
                echo "$setting: not on this processor (it has no AVX-512)"
                return
            }
            settings=("NUMBA_CPU_NAME=generic" "NUMBA_CPU_FEATURES=$(features 'none'),-prefer-256-bit")
            ;;
        no-fma) settings=("NUMBA_CPU_NAME=generic" "NUMBA_CPU_FEATURES=$(features 'fma|avx512')") ;;
        load8) load=8 ;;
        user) user=somebody above=/home/somebody home=/home/somebody ;;
        umlaut) inner="/eigene Prüfung" ;;
        home-read-only) user=somebody above=/srv home=/home/read-only ;;
        container)
            above=/srv
            commands=(
                "rm -rf /opt/image /opt/hpcclear; /usr/sbin/userdel -rf user; python3 -m venv /opt/image && PATH=/opt/image/bin:/usr/sbin:\$PATH &&
                    cp -r . /opt/hpcclear && $(sed -n 's/^RUN //p' packaging/Dockerfile)"
                "PATH=/opt/image/bin:\$PATH && cd \$(mktemp -d) && hpcclear --version && hpcclear init engine.toml &&
                    mpiexec -n 2 hpcclear check engine.toml --no-cost"
            )
            ;;
        esac
    done
    local folder=$above$inner/hpcclear
    root_of "$release"
    local root=$place/$release log=$results/$setting.log
    chroot "$root" sh -c "id somebody >/dev/null 2>&1 || useradd -m somebody; mkdir -p /home/read-only"
    rm -rf --one-file-system "$root$folder"
    mkdir -p "$root$folder"
    git clone -q --no-hardlinks "$checkout" "$root$folder"
    chroot "$root" chown -R "$user" "$folder"

    # Only names of what pip needs pass; everything else is as after a login.
    local passed=() name
    for name in $(compgen -e | grep -E '^(PIP_|SSL_|REQUESTS_CA|CURL_CA)|^(https?|no)_proxy$|^(HTTPS?|NO)_PROXY$'); do
        case $name in
        PIP_FIND_LINKS | PIP_CONFIG_FILE | PIP_CONSTRAINT) ;; # paths of this machine
        *) passed+=("$name=${!name}") ;;
        esac
    done

    local helpers=() number
    for ((number = 0; number < load; number++)); do
        nice -n 0 sh -c 'while :; do :; done' &
        helpers+=($!)
    done
    local times=() codes=() command start
    : >"$log"
    [ ${#commands[@]} -gt 0 ] || commands=("bash jobs/quickstart.sh $option" "bash tests/run.sh $option $words")
    for command in "${commands[@]}"; do
        start=$SECONDS code=0
        echo "== $setting: $command" | tee -a "$log"
        # Mounts live in a namespace of their own and are gone with it, whatever happens.
        unshare --mount --pid --fork --kill-child bash -euc '
            root=$1 folder=$2 user=$3; shift 3
            mount -t proc proc "$root/proc"
            mount --rbind --make-rslave /sys "$root/sys"
            mount --rbind --make-rslave /dev "$root/dev"
            mount -t devpts -o newinstance,ptmxmode=0666,mode=0620 devpts "$root/dev/pts"
            mount --bind "$root/dev/pts/ptmx" "$root/dev/ptmx"
            mount -t tmpfs -o mode=1777 tmpfs "$root/dev/shm"
            [ ! -d "$root/home/read-only" ] || mount -t tmpfs -o ro tmpfs "$root/home/read-only"
            exec chroot "$root" setpriv --reuid "$user" --regid "$(chroot "$root" id -g "$user")" --init-groups \
                env -i "$@"' mounts "$root" "$folder" "$user" \
            "PATH=/usr/local/bin:/usr/bin:/bin" "HOME=$home" "LANG=C.UTF-8" "TERM=dumb" "USER=$user" \
            "${passed[@]}" "${settings[@]}" \
            bash -c "cd '$folder' && $command" >>"$log" 2>&1 </dev/null || code=$?
        times+=($((SECONDS - start)))
        codes+=("$code")
    done
    for number in "${helpers[@]}"; do kill "$number"; done
    verdict() { printf '%s %d:%02d' "$([ "$1" = 0 ] && echo green || echo "red ($1)")" $(($2 / 60)) $(($2 % 60)); }
    printf '| %s | %s | %s | %s | %s | %s |\n' "$setting" "$(chroot "$root" python3 -c 'import platform; print(platform.python_version())')" \
        "$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -1)" "$(verdict "${codes[0]}" "${times[0]}")" \
        "$(verdict "${codes[1]}" "${times[1]}")${words:+ ($words)}" "$(git -C "$root$folder" rev-parse --short HEAD)" | tee "$results/$setting.row"
    [ "${codes[*]}" = "0 0" ]
}

run_words=""
settings=()
while [ $# -gt 0 ]; do
    case $1 in
    --table)
        table
        exit
        ;;
    --with)
        run_words=${2:-}
        shift
        ;;
    *)
        for part in ${1//+/ }; do
            case $part in
            debian12 | debian13 | python314 | lowest | latest | bits256 | bits512 | no-fma | load8 | user | umlaut | home-read-only | container) ;;
            *) refuse "there is no setting $part" ;;
            esac
        done
        settings+=("$1")
        ;;
    esac
    shift
done
[ ${#settings[@]} -gt 0 ] || refuse "name a setting: $(sed -n 's/^# Settings: \(.*home-read-only\)\..*/\1/p' "$0")"
[ "$(id -u)" = 0 ] || refuse "only root makes roots and mounts"
command -v debootstrap >/dev/null || refuse "debootstrap is not installed (apt-get install debootstrap)"
unshare --mount true 2>/dev/null || refuse "mounts are not allowed here"
git diff --quiet HEAD || echo "elsewhere: what is not committed is not in the clone" >&2
mkdir -p "$results"
red=0
for setting in "${settings[@]}"; do
    run_setting "$setting" & # in the background `set -e` holds; after `||` it would not
    wait $! || red=1
done
exit $red
