# Yield stresses of 304L steel at strain rates (1/s), X Y0 (1 + C ln(rate/1e-5)) in MPa.
# Usage: sh rates.sh Y0 C X RATE…   X is the ratio of the 0.2 % offset yield stress to the yield stress of the law.
awk -v y="$1" -v c="$2" -v x="$3" -v all="$(shift 3; echo "$*")" 'BEGIN {
  count = split(all, rates, " ")
  for (k = 1; k <= count; k++) printf "yield_at_%s_per_s_MPa%s", rates[k], (k < count ? "," : "\n")
  for (k = 1; k <= count; k++) printf "%.10g%s", x * y * (1 + c * log(rates[k] / 1e-5)), (k < count ? "," : "\n")
}' > result.csv
