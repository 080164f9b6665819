"""How exact, and at what cost: suites of cases with known answers, run by the product's own code."""
