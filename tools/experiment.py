"""Run an experiment of tools/experiments: measure, print or store, and make the tables of the docs.

python tools/experiment.py                          list all experiments
python tools/experiment.py NAME [OPTION ...]        run one; --help shows its options
python tools/experiment.py NAME --resume            go on with a stopped run of a suite
python tools/experiment.py NAME --against TREE      compare with another checkout, by turns
python tools/experiment.py --stale                  list how old each stored run is
"""

import sys

from experiments.command import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
