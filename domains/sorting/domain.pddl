; Boxes and cylinders into trays, moved one at a time by one arm.
(define (domain sorting)
  (:requirements :strips :typing)
  (:types
    item tray robot - object
    box cylinder - item)
  (:predicates
    (in ?x - item ?t - tray)     ; ?x lies in ?t             observed
    (ontable ?x - item)          ; ?x stands on the table    completed
    (holding ?x - item)          ; ?x is in the gripper      proprioceptive
    (handempty ?r - robot)       ; the gripper is empty      proprioceptive
    (handfull ?r - robot))       ; the gripper is not empty  proprioceptive

  (:action pick_up
    :parameters (?x - item ?r - robot)
    :precondition (and (ontable ?x) (handempty ?r))
    :effect (and
      (holding ?x) (handfull ?r)
      (not (ontable ?x)) (not (handempty ?r))))

  (:action put_down
    :parameters (?x - item ?r - robot)
    :precondition (and (holding ?x) (handfull ?r))
    :effect (and
      (ontable ?x) (handempty ?r)
      (not (holding ?x)) (not (handfull ?r))))

  (:action put_in
    :parameters (?x - item ?t - tray ?r - robot)
    :precondition (and (holding ?x) (handfull ?r))
    :effect (and
      (in ?x ?t) (handempty ?r)
      (not (holding ?x)) (not (handfull ?r))))

  (:action take_out
    :parameters (?x - item ?t - tray ?r - robot)
    :precondition (and (in ?x ?t) (handempty ?r))
    :effect (and
      (holding ?x) (handfull ?r)
      (not (in ?x ?t)) (not (handempty ?r)))))
