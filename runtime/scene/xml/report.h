// Collects all errors of a scene, so that one run tells everything.
#pragma once
#include <set>
#include <string>
#include <vector>

#include "runtime/scene/xml/message.h"

namespace itn {

// A file so large that looking at the rest of it would take too long: no problem among others, but the end.
struct TooMuch : LocatedError {
  using LocatedError::LocatedError;
};

class Report {
 public:
  // Each message counts once, however many elements refer to what is wrong.
  void add(const Location& where, const std::string& what);
  void warn(const Location& where, const std::string& what);

  // Runs `build`. What it throws as InputError becomes one more problem; false then.
  template <class Build>
  bool attempt(Build build) {
    try {
      build();
      return true;
    } catch (const TooMuch&) {
      throw;
    } catch (const LocatedError& error) {
      add_message(error.where, error.what());
    } catch (const InputError& error) {
      add_message({}, error.what());
    }
    return false;
  }

  // So many problems are told already that nobody reads more.
  bool is_full() const;

  // Throws InputErrors with every problem, a line each, in the order of the files; returns when there is none.
  void raise() const;

  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  struct Problem {
    Location where;
    std::string message;
  };
  void add_message(const Location& where, const std::string& message);

  std::vector<Problem> problems_;
  std::vector<std::string> warnings_;
  std::set<std::string> told_;  // messages
};

}  // namespace itn
