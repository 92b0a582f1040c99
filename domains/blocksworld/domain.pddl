; Blocks on a table, moved one at a time by one arm. Predicates and actions are named as in ProDG-v.
(define (domain blocksworld)
  (:requirements :strips :typing)
  (:types block robot - object)
  (:predicates
    (on ?x - block ?y - block)   ; ?x stands on ?y           observed
    (ontable ?x - block)         ; ?x stands on the table    completed
    (clear ?x - block)           ; ?x can be grasped         completed
    (holding ?x - block)         ; ?x is in the gripper      proprioceptive
    (handempty ?r - robot)       ; the gripper is empty      proprioceptive
    (handfull ?r - robot))       ; the gripper is not empty  proprioceptive

  (:action pick_up
    :parameters (?x - block ?r - robot)
    :precondition (and (clear ?x) (ontable ?x) (handempty ?r))
    :effect (and
      (holding ?x) (handfull ?r)
      (not (clear ?x)) (not (ontable ?x)) (not (handempty ?r))))

  (:action put_down
    :parameters (?x - block ?r - robot)
    :precondition (and (holding ?x) (handfull ?r))
    :effect (and
      (clear ?x) (ontable ?x) (handempty ?r)
      (not (holding ?x)) (not (handfull ?r))))

  (:action stack
    :parameters (?x - block ?y - block ?r - robot)
    :precondition (and (holding ?x) (clear ?y) (handfull ?r))
    :effect (and
      (on ?x ?y) (clear ?x) (handempty ?r)
      (not (holding ?x)) (not (clear ?y)) (not (handfull ?r))))

  (:action unstack
    :parameters (?x - block ?y - block ?r - robot)
    :precondition (and (on ?x ?y) (clear ?x) (handempty ?r))
    :effect (and
      (holding ?x) (clear ?y) (handfull ?r)
      (not (on ?x ?y)) (not (clear ?x)) (not (handempty ?r)))))
