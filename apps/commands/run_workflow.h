#pragma once

#include <string>
#include <vector>

#include "apps/commands/chain_run.h"

namespace atelier {

/// Becomes Snakemake, which runs the jobs of `atelier plan` as workflow/Snakefile says: on this
/// machine, or where a profile of Snakemake sends them. Does not return. Throws EnvironmentError
/// where Snakemake or the workflow's file is missing.
/// @param options  flags of stages (given_flags), which every job gets
void run_workflow(const RunArguments& arguments, std::vector<std::string> options);

}  // namespace atelier
