"""A grid by loops, nodes as objects, demand across it, and control while it runs."""

from uxsim_geo import *

W = World(name="_grid", deltan=5, tmax=1800, print_mode=1, save_mode=0, random_seed=0)

imax = 4
nodes = {}
for i in range(imax):
    for j in range(imax):
        nodes[i, j] = W.addNode(f"n{(i, j)}", i, j, signal=[30, 30])
links = {}
for i, j in nodes:
    for k, m in ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)):
        if (k, m) in nodes:
            links[i, j, k, m] = W.addLink(
                f"l{(i, j, k, m)}",
                nodes[i, j],
                nodes[k, m],
                length=500,
                free_flow_speed=20,
                jam_density=0.2,
                signal_group=int(j != m),
            )
for i in range(imax):
    for j in range(imax):
        W.adddemand(nodes[0, i], nodes[imax - 1, j], 0, 900, 0.03)
        W.adddemand(nodes[i, 0], nodes[j, imax - 1], 0, 900, 0.03)

while W.check_simulation_ongoing():
    W.exec_simulation(duration_t=100)
    for node in nodes.values():
        waiting = {link.signal_group[0]: link.num_vehicles for link in node.inlinks.values()}
        node.signal_phase = max(waiting, key=waiting.get)
        node.signal_t = 0
    if W.on_time(600):
        links[0, 0, 1, 0].merge_priority = 0.2
    if W.on_time(800):
        links[0, 0, 1, 0].free_flow_speed = 5
    if W.on_time(1000):
        links[0, 0, 1, 0].capacity_in = links[0, 0, 1, 0].capacity / 2

W.analyzer.print_simple_stats()
W.analyzer.time_space_diagram_traj_links([[links[1, i, 1, i + 1] for i in range(imax - 1)]])
print(W.analyzer.od_to_pandas())
