// The requests of the page of `itn view` and their answers, without the connections.
#pragma once
#include <map>
#include <mutex>
#include <string>

#include "itn/load_scene.h"
#include "runtime/view/session.h"
#include "tools/itn/loopback_server.h"

namespace itn::tools {

// The origin of the scene, to save it again.
struct ViewedScene {
  std::string file;
  std::map<std::string, std::string> definitions;
  LoadOptions options;
};

//   GET  /, /view.css, /view.js, /icon.svg   the page
//   GET  /parameters                 names, ranges, sliders and what the session is about: JSON
//   GET  /frame?after=N&look=M       waits a moment for a later frame: see frame() in the source file
//   POST /set                        {NAME: VALUE, ...}
//   POST /look                       {"derivative": NAME or "", "fit": [NAME, ...], "exposure": STOPS or "automatic"}
//   POST /step                       to where Gauss-Newton would step
//   GET  /scene.xml, /image.exr, /image.png   what is seen, as files
// Answers that are no files are JSON; {"error": TEXT} where they fail.
class ViewPage {
 public:
  ViewPage(ViewSession& session, ViewedScene scene);

  // Any thread may call it. Does not throw.
  WebResponse answer(const WebRequest& request);

 private:
  WebResponse dispatch(const WebRequest& request);
  WebResponse parameters() const;
  WebResponse frame(const WebRequest& request);
  WebResponse set(const std::string& body);
  WebResponse look(const std::string& body);
  WebResponse scene_file();
  WebResponse exr_file();
  WebResponse png_file();
  std::string file_name(const std::string& ending) const;
  struct Look {
    std::uint64_t number = 1;  // each change makes another
    double automatic = 1;      // exposure
    double stops = 0;          // beyond it
    double exposure() const;
  };
  Look look_at(const ViewFrame& frame);

  ViewSession& session_;
  ViewedScene scene_;
  std::mutex mutex_;
  Look look_;
  bool settled_ = false;  // the automatic exposure stays, so that a darker image looks darker
};

}  // namespace itn::tools
