# Golden numbers for ppl's diagnostics, from the R package posterior:
#
#     Rscript posterior.R > posterior.json
#
# The draws come from draws.py, whose rule the Rust test repeats bit for bit.
library(posterior)

cases <- list(
  list(seed = 1, count = 4, draws = 500, rho = 0.0, shift = 0.0, cubed = FALSE, rounded = FALSE),
  list(seed = 2, count = 4, draws = 501, rho = 0.8, shift = 0.0, cubed = FALSE, rounded = FALSE),
  list(seed = 3, count = 3, draws = 200, rho = 0.3, shift = 0.7, cubed = FALSE, rounded = FALSE),
  list(seed = 4, count = 2, draws = 250, rho = -0.6, shift = 0.0, cubed = FALSE, rounded = FALSE),
  list(seed = 5, count = 4, draws = 300, rho = 0.5, shift = 0.0, cubed = TRUE, rounded = FALSE),
  list(seed = 6, count = 4, draws = 300, rho = 0.5, shift = 0.0, cubed = FALSE, rounded = TRUE),
  list(seed = 7, count = 1, draws = 400, rho = 0.9, shift = 0.0, cubed = FALSE, rounded = FALSE)
)

word <- function(x) if (is.logical(x)) tolower(as.character(x)) else format(x, digits = 17)
pairs <- function(x) paste0("\"", names(x), "\": ", vapply(x, word, ""), collapse = ", ")

describe <- function(case) {
  command <- paste("python3 draws.py", paste(vapply(case, word, ""), collapse = " "))
  x <- as.matrix(read.table(text = system(command, intern = TRUE)))
  dimnames(x) <- NULL
  numbers <- list(
    rhat = rhat(x), rhat_basic = rhat_basic(x), ess_bulk = ess_bulk(x), ess_tail = ess_tail(x),
    ess_mean = ess_mean(x), ess_sd = ess_sd(x), ess_median = unname(ess_quantile(x, 0.5)),
    mcse_mean = mcse_mean(x), mcse_sd = mcse_sd(x),
    mcse_q05 = unname(mcse_quantile(x, 0.05)), mcse_median = unname(mcse_quantile(x, 0.5))
  )
  paste0("  {\"case\": {", pairs(case), "},\n   ", pairs(numbers), "}")
}

cat("{\"made_by\": {\"posterior\": \"", as.character(packageVersion("posterior")),
    "\", \"R\": \"", as.character(getRversion()), "\"},\n \"chains\": [\n", sep = "")
cat(paste(vapply(cases, describe, ""), collapse = ",\n"), "\n]}\n", sep = "")
