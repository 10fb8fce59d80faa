#!/usr/bin/env bash
# Fails, with the list of files, where clang-format 14 would change something; --fix changes it.
set -euo pipefail
cd "$(dirname "$0")/.."
tool=$(command -v clang-format-14 || true)
if [ -z "$tool" ]; then echo "skipped: clang-format-14 is not installed"; exit 77; fi
mapfile -t files < <(find src tests examples fuzz -name '*.h' -o -name '*.cc' | sort)
if [ "${1:-}" = --fix ]; then exec "$tool" -i "${files[@]}"; fi
faults=0
while IFS= read -r file; do
  if ! "$tool" --dry-run -Werror "$file" 2> /dev/null; then echo "$file: not formatted (run tools/check_format.sh --fix)"; faults=1; fi
done < <(printf '%s\n' "${files[@]}")
exit $faults
