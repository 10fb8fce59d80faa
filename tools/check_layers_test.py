#!/usr/bin/env python3
"""Tests of check_layers.py on small trees with one fault each."""
import pathlib
import tempfile
import unittest

import check_layers


class CheckLayersTest(unittest.TestCase):
    def faults_of(self, files):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name, text in files.items():
                path = root / "src" / "semvslam" / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text)
            return check_layers.check_tree(root)

    def test_allowed_arrows_pass(self):
        self.assertEqual([], self.faults_of({
            "map/map.cc": '#include "semvslam/feature/features.h"\n#include "semvslam/base/ids.h"\n#include <vector>\n',
            "feature/orb.cc": "#include <opencv2/core.hpp>\n",
            "map/CMakeLists.txt": "semvslam_module(map SOURCES map.cc LINKS semvslam::feature semvslam::base)"}))

    def test_forbidden_include_is_found_with_its_line(self):
        faults = self.faults_of({"solve/a.cc": '\n  #  include "semvslam/map/map.h"\n'})
        self.assertEqual(["src/semvslam/solve/a.cc:2: solve may not use map (semvslam/map/map.h)"], faults)

    def test_forbidden_link_is_found(self):
        faults = self.faults_of({"map/CMakeLists.txt": "semvslam_module(map\n  SOURCES a.cc\n  PRIVATE_LINKS semvslam::tracking)"})
        self.assertEqual(["src/semvslam/map/CMakeLists.txt: map may not link tracking"], faults)
        faults = self.faults_of({"map/CMakeLists.txt": "semvslam_module(map LINKS semvslam_tracking)"})
        self.assertEqual(1, len(faults))

    def test_comments_in_cmake_do_not_count(self):
        self.assertEqual([], self.faults_of({"map/CMakeLists.txt": "semvslam_module(map # not semvslam::tracking\n SOURCES a.cc)"}))

    def test_core_may_not_know_render_eval_or_apps(self):
        for used in ("render", "eval", "apps"):
            self.assertEqual(1, len(self.faults_of({"pipeline/a.cc": f'#include "semvslam/{used}/x.h"\n'})), used)

    def test_tests_may_render_their_input_but_not_reach_up(self):
        self.assertEqual([], self.faults_of({"tracking/a_test.cc": '#include "semvslam/render/scene_source.h"\n'}))
        self.assertEqual(1, len(self.faults_of({"solve/a_test.cc": '#include "semvslam/pipeline/slam.h"\n'})))

    def test_foreign_libraries_stay_in_their_place(self):
        self.assertEqual(1, len(self.faults_of({"solve/a.h": "#include <opencv2/core.hpp>\n"})))
        self.assertEqual(1, len(self.faults_of({"mapping/a.cc": "#include <ceres/ceres.h>\n"})))
        self.assertEqual([], self.faults_of({"solve/a_test.cc": "#include <opencv2/calib3d.hpp>\n"}))
        self.assertEqual(1, len(self.faults_of({"geometry/a_test.cc": "#include <ceres/ceres.h>\n"})))

    def test_long_files_and_unknown_modules_are_found(self):
        self.assertIn("501 lines", self.faults_of({"base/a.cc": "//\n" * 501})[0])
        self.assertEqual([], self.faults_of({"base/a.cc": "//\n" * 500}))
        self.assertIn("unknown module", self.faults_of({"misc/a.cc": ""})[0])

    def test_temporary_folders_have_no_names_of_their_own(self):
        self.assertIn("TemporaryFolder", self.faults_of({"map/a_test.cc": 'auto f = fs::path(testing::TempDir()) / "mine";\n'})[0])
        self.assertEqual(1, len(self.faults_of({"map/a_test.cc": 'auto f = fs::temp_directory_path();\n'})))
        self.assertEqual([], self.faults_of({"base/temporary_folder_test_support.h": "fs::temp_directory_path();\n"}))

    def test_circle_in_the_table_is_found(self):
        saved = check_layers.ALLOWED
        try:
            check_layers.ALLOWED = {"a": {"b"}, "b": {"c"}, "c": {"a"}}
            faults = []
            check_layers.check_table(faults)
            self.assertEqual(["allowed arrows run in a circle: a -> b -> c -> a"], faults)
        finally:
            check_layers.ALLOWED = saved


if __name__ == "__main__":
    unittest.main()
