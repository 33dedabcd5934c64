# Yield stress of 304L steel at five strain rates: X Y0 (1 + C ln(rate/1e-5)), in MPa. Usage: sh rates.sh INPUT
# X is the ratio of the 0.2 % offset yield stress of a test to the yield stress of the law.
value() { sed -n "s/^$1 = //p" "$input"; }
input=$1
awk -v y="$(value yield_mpa)" -v c="$(value c)" -v x="$(value offset)" 'BEGIN {
  count = split("0.0001 0.01 500 1800 3600", rates, " ")
  for (k = 1; k <= count; k++) printf "yield_at_%s_per_s_MPa%s", rates[k], (k < count ? "," : "\n")
  for (k = 1; k <= count; k++) printf "%.10g%s", x * y * (1 + c * log(rates[k] / 1e-5)), (k < count ? "," : "\n")
}' > result.csv
