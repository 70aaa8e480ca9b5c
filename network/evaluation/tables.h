// The tables of an evaluation, as text for the terminal and for the page.
#pragma once
#include <string>
#include <vector>

#include "network/evaluation/evaluation.h"

namespace itn {

struct ReportTable {
  std::string title;
  std::vector<std::vector<std::string>> rows;  // first: headings
  std::vector<std::string> notes;
};

std::vector<ReportTable> tables_of(const Evaluation& e);

// Aligned columns.
std::string as_text(const ReportTable& table);

// "12.3 (11 to 14)"; without an interval the value alone.
std::string as_text(const Estimate& estimate);

}  // namespace itn
